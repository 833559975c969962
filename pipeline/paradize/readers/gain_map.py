"""JPEGs with a gain map (Ultra HDR), as phones save photographs.

OpenImageIO applies the map: it returns light that goes beyond white. Programs that know no gain map show the
picture that the file holds before it, of 8 bits, and a texture is this one. Source: Google, "Ultra HDR Image
Format", version 1.1, 2024.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from paradize.files import open_file
from paradize.readers.pillow import decode

if TYPE_CHECKING:
    from pathlib import Path

    from paradize.data import Image

LEFT_OUT = "its gain map (Ultra HDR) is left out, as for a screen that shows nothing brighter than white"
_JPEG, _SCAN, _XMP = b"\xff\xd8\xff", b"\xda", b"\xe1"
_VERSION = b"hdrgm:Version"  # in the XMP of the first picture; OpenImageIO looks for it too


def read_without_gain(path: Path, head: bytes, color_space: str | None) -> Image | None:
    """The first picture of a JPEG with a gain map; None for any other file. Raises as read_with_pillow."""
    if not head.startswith(_JPEG) or not _has_gain_map(path):
        return None
    image = decode("Jpeg", path, head, color_space)
    return replace(image, color_notes=(LEFT_OUT, *image.color_notes))


def _has_gain_map(path: Path) -> bool:
    """Whether a segment before the first scan says so."""
    with open_file(path) as stream:
        stream.seek(2)
        while stream.read(1) == b"\xff":
            while (marker := stream.read(1)) == b"\xff":
                pass
            size = int.from_bytes(stream.read(2), "big") - 2
            if size < 0 or marker == _SCAN:
                return False
            if marker != _XMP:
                stream.seek(size, 1)
            elif _VERSION in stream.read(size):
                return True
    return False
