"""Reads the parts of a DDS header that OpenImageIO ignores.

Source: Microsoft, "DDS_PIXELFORMAT structure" and "Programming guide for DDS", documentation of Direct3D.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NamedTuple

from paradize.errors import SourceError
from paradize.files import open_file
from paradize.readers.notes import NARROWED

if TYPE_CHECKING:
    from pathlib import Path

_HEAD, _NEWER = 128, 4  # bytes: magic and header; the format behind them where the code is "DX10"
# Flags: the texel has alpha, or nothing else; a code names the format; it is grey.
_ALPHA, _CODE, _LUMINANCE = 0x3, 0x4, 0x20000
_SHORTS = (11, 13, 35, 37, 56, 58)  # DXGI formats of 16 bits a channel that are decoded


class DdsHead(NamedTuple):
    """grey_alpha: whether two channels are grey and alpha, not red and green. note: for the user, or ""."""

    grey_alpha: bool = False
    note: str = ""


def read_dds_head(path: Path) -> DdsHead:
    """Raises SourceError where a channel's bits lie outside its texel, as some programs write grey."""
    with open_file(path) as file:
        data = file.read(_HEAD + _NEWER)
    if len(data) < _HEAD:
        return DdsHead()
    flags, code, bits, *masks = struct.unpack_from("<7I", data, 80)
    if flags & _CODE:
        newer = code == int.from_bytes(b"DX10", "little") and len(data) == _HEAD + _NEWER
        wide = newer and struct.unpack_from("<I", data, _HEAD)[0] in _SHORTS
        return DdsHead(note=NARROWED if wide else "")
    channels = masks[: 1 if flags & _LUMINANCE else 3] + (masks[3:] if flags & _ALPHA else [])
    used = 0
    for mask in channels:
        used |= mask
    if used >> bits:
        what = f"a channel has bits {used:#x} of a texel of {bits} bits"
        raise SourceError(what, file=path, mend="save it as PNG")
    wide = any(mask.bit_count() > 8 for mask in channels)
    return DdsHead(bool(flags & _LUMINANCE), NARROWED if wide else "")
