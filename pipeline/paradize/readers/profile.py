"""Tells pictures that say that their colours are others than sRGB's, which is what they are read as."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

# Of a probe's channels. Darker ones would show a curve of 2.2, which programs take for sRGB's.
_CODES = (64, 128, 192)
_READ_SO = ("srgb_rec709_scene", "g22_rec709_scene", "")  # OpenImageIO's words; a gamma of 2.2 is near sRGB's
_PRIMARIES = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)  # of Rec. 709 and sRGB, and its white, x and y
_OFF = 0.02  # of a primary
_NEAR = 10  # codes of 255: profiles are written with rounded primaries and curves


def declared_note(declared: str, color_space: str) -> tuple[str, ...]:
    """The note for colours that a PNG's header, not a profile, says to be others than sRGB's. declared:
    OpenImageIO's word. color_space: what they are read as, "srgb" or "linear"."""
    if declared == "lin_rec709_scene":
        return ("says that it is linear, and is read so",) if color_space == "linear" else ()
    what = f"its colours are declared {declared}, read as if they were sRGB; convert it to sRGB"
    return () if declared in _READ_SO else (what,)


def primaries_note(primaries: Any) -> tuple[str, ...]:
    """The note for an OpenEXR of other primaries: x and y of red, green, blue and white, or none of that."""
    known = isinstance(primaries, tuple) and len(primaries) == len(_PRIMARIES)
    if not known or not all(isinstance(value, float) for value in primaries):
        return ()
    if np.abs(np.subtract(primaries, _PRIMARIES)).max() <= _OFF:
        return ()
    return ("its colours are of other primaries (chromaticities), read as if they were Rec. 709; convert it",)


def profile_note(profile: bytes) -> tuple[str, ...]:
    """The note for colours whose profile is not sRGB; none for one of CMYK, which decoders apply, and for
    one that cannot be read."""
    from PIL import Image, ImageCms  # only files with a profile need them

    grid = np.stack(np.meshgrid(_CODES, _CODES, _CODES), axis=-1).reshape(1, -1, 3).astype(np.uint8)
    try:
        read = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        if (space := read.profile.xcolor_space.strip()) not in ("RGB", "GRAY"):
            return ()
        probe = Image.fromarray(grid) if space == "RGB" else Image.fromarray(grid[:, :, 0])
        shown = ImageCms.profileToProfile(probe, read, ImageCms.createProfile("sRGB"), outputMode="RGB")
        name = ImageCms.getProfileDescription(read).strip()
    except (ImageCms.PyCMSError, OSError, ValueError):
        return ()
    off = np.abs(np.asarray(shown, np.int64) - np.asarray(probe.convert("RGB"), np.int64)).max()
    what = f"its colours are of the profile {name[:80]!r}, read as if they were sRGB; convert it to sRGB"
    return (what,) if off > _NEAR else ()
