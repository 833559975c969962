"""What the readers of pictures tell users of pictures that they read otherwise than one may expect."""

from __future__ import annotations

NARROWED = "has channels of more than 8 bits, which are read with 8; a PNG of 16 bits keeps them"
SEVERAL = "holds several pictures; the first is read"


def turned(way: int) -> str:
    """Of a picture whose Exif orientation, 2 to 8, asks that it be turned or mirrored."""
    return f"says that it is to be turned (orientation {way}); read as its texels lie: save it upright"
