"""JPEGs with a gain map (Ultra HDR), as phones save photographs.

OpenImageIO applies the map: it returns light that goes beyond white. Programs that know no gain map show the
picture that the file holds before it, of 8 bits, and a texture is this one. Source: Google, "Ultra HDR Image
Format", version 1.1, 2024.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from paradize.readers.pillow import decode

if TYPE_CHECKING:
    from pathlib import Path

    from paradize.data import Image

LEFT_OUT = "its gain map (Ultra HDR) is left out, as for a screen that shows nothing brighter than white"


def has_gain(source: Any) -> bool:
    """Whether OpenImageIO applies a gain map to a picture that it has opened: no other JPEG has floats."""
    return source.format_name() == "jpeg" and str(source.spec().format) in ("half", "float")


def read_without_gain(path: Path, head: bytes, color_space: str | None) -> Image:
    """The first picture of a JPEG with a gain map. Raises as read_with_pillow."""
    image = decode("Jpeg", path, head, color_space)
    return replace(image, color_notes=(LEFT_OUT, *image.color_notes))
