"""Words of several readers about pictures that they read otherwise than one may expect, or not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from paradize.errors import SourceError

if TYPE_CHECKING:
    from pathlib import Path

NARROWED = "has channels of more than 8 bits, which are read with 8; a PNG of 16 bits keeps them"
SEVERAL = "holds several pictures; the first is read"
MASKED = "has a mask of the pixels that count, which is not read; write no data into the pixels themselves"
FOURTH = "its fourth channel is taken for alpha, as game engines take it"


def turned(way: int) -> str:
    """The note for a picture whose Exif orientation, 2 to 8, asks that it be turned or mirrored."""
    return f"says that it is to be turned (orientation {way}); read as its texels lie: save it upright"


def other_colors(profile: str) -> str:
    """The note for colours whose profile is not sRGB."""
    return f"its colours are of the profile {profile!r}, read as if they were sRGB; convert it to sRGB"


def part_of(spec: Any) -> str:
    """The note for an OpenEXR whose data window is not its display window."""
    return (
        f"holds {spec.width} x {spec.height} texels, from ({spec.x}, {spec.y}) on, of a picture of "
        f"{spec.full_width} x {spec.full_height}; read as a picture of their own: save the whole"
    )


def high_range(curve: str, path: Path) -> SourceError:
    """The error for colours beyond white."""
    what = f"its colours are of high dynamic range ({curve}), not sRGB"
    return SourceError(what, file=path, mend="save it as OpenEXR")


def six_faces(path: Path) -> SourceError:
    """The error for a cube map."""
    mend = "save each face as a picture of its own"
    return SourceError("the six faces of a cube map are not one picture", file=path, mend=mend)
