"""Limits of pictures: texels, and MB of the decoded picture. Environment variables set them."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from paradize.errors import BakeError, SourceError

if TYPE_CHECKING:
    from pathlib import Path

# Variable -> default. The largest supported map is 16384 x 16384.
LIMITS = {"PARADIZE_MAX_SIDE": 32768, "PARADIZE_MAX_TEXELS": 1 << 29, "PARADIZE_MAX_MB": 8192}


def limit(name: str) -> int:
    """The limit `name` of LIMITS or of the environment. Raises BakeError where the variable is not an integer
    above 0."""
    text = os.environ.get(name, "")
    if not text:
        return LIMITS[name]
    if not (text.isascii() and text.isdigit() and len(text) <= 18 and int(text) > 0):
        raise BakeError(f"${name} is {text!r:.40}; expected a whole number above 0", mend="set or unset it")
    return int(text)


def require_size(width: int, height: int, texel_bytes: int, path: Path) -> None:
    """Raises SourceError for a picture beyond the limits."""
    side, texels, megabytes = map(limit, LIMITS)
    if width > side or height > side or width * height > texels:
        what = f"{width} x {height} texels; at most {side} per side and {texels} in all are read"
        mend = "make it smaller, or raise PARADIZE_MAX_SIDE and PARADIZE_MAX_TEXELS"
        raise SourceError(what, file=path, mend=mend)
    if width * height * texel_bytes > megabytes << 20:
        raise too_many_bytes(path)


def too_many_bytes(path: Path) -> SourceError:
    """The error for a picture of more bytes than may be decoded."""
    what = f"its texels take more than {limit('PARADIZE_MAX_MB')} MB"
    return SourceError(what, file=path, mend="make it smaller, or raise PARADIZE_MAX_MB")
