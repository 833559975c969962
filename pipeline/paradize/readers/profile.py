"""Tells pictures whose ICC profile means other colours than sRGB, which is what their texels are read as."""

from __future__ import annotations

import io

import numpy as np

# Of a probe's channels. Darker ones would show a curve of 2.2, which programs take for sRGB's.
_CODES = (64, 128, 192)
_NEAR = 10  # codes of 255: profiles are written with rounded primaries and curves


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
