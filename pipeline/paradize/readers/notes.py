"""Words of several readers about pictures that they read otherwise than one may expect, or not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from paradize.errors import SourceError

if TYPE_CHECKING:
    from pathlib import Path

NARROWED = "has channels of more than 8 bits, which are read with 8; a PNG of 16 bits keeps them"
SEVERAL = "holds several pictures; the first is read"


def turned(way: int) -> str:
    """The note for a picture whose Exif orientation, 2 to 8, asks that it be turned or mirrored."""
    return f"says that it is to be turned (orientation {way}); read as its texels lie: save it upright"


def six_faces(path: Path) -> SourceError:
    """The error for a cube map."""
    mend = "save each face as a picture of its own"
    return SourceError("the six faces of a cube map are not one picture", file=path, mend=mend)
