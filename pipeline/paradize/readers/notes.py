"""Words of several readers about pictures that they read otherwise than one may expect, or not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from paradize.errors import SourceError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

_SMALLER, _MASK = 1, 4  # bits of TIFF's NewSubfileType

NARROWED = "has channels of more than 8 bits, which are read with 8; a PNG of 16 bits keeps them"
SEVERAL = "holds several pictures; the first is read"
FIRST_BAND = "has several channels that are no colours; the first is read"
MASKED = "has a mask, which is not read; give the pixels that it leaves out the no-data value"
FOURTH = "its fourth channel is taken for alpha, as game engines take it"
UNREAD_LAYERS = "its layers cannot be read; the picture of all of them is read, as other programs show it"
LEFT_OUT = "has more channels than its colours, which are not read; save it as PNG with its alpha"


def turned(way: int) -> str:
    """The note for a picture whose Exif orientation, 2 to 8, asks that it be turned or mirrored."""
    return f"says that it is to be turned (orientation {way}); read as its texels lie: save it upright"


def pages(roles: Iterable[int]) -> list[str]:
    """The notes for the pictures of a file after its first: roles are TIFF's NewSubfileType."""
    notes = []
    for role in roles:
        if role & _MASK:
            notes += [MASKED] if MASKED not in notes else []
        elif not role & _SMALLER:
            return [*notes, SEVERAL]
    return notes


def left_out(kept: list[str], left: list[str]) -> str:
    """The note for a picture of which only some channels are read, by their names."""
    more = f" and {len(left) - 4} more" if len(left) > 4 else ""
    return f"channels read: {', '.join(kept)}; left out: {', '.join(left[:4])}{more}"


def beside_display(spec: Any) -> str:
    """The note for an OpenEXR whose data window is not its display window. spec: OpenImageIO's."""
    x, y = spec.x - spec.full_x, spec.y - spec.full_y
    return (
        f"its {spec.width} x {spec.height} texels begin at ({x}, {y}) of a picture of {spec.full_width} x "
        f"{spec.full_height}; they are read as a whole picture"
    )


def high_range(curve: str, path: Path) -> SourceError:
    """The error for colours beyond white."""
    what = f"its colours are of high dynamic range ({curve}), not sRGB"
    return SourceError(what, file=path, mend="save it as OpenEXR")


def six_faces(path: Path) -> SourceError:
    """The error for a cube map."""
    mend = "save each face as a picture of its own"
    return SourceError("the six faces of a cube map are not one picture", file=path, mend=mend)
