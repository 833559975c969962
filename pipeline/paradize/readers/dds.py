"""Reads what OpenImageIO 3.2 does not of DDS files: channels of 16 and 32 bits, and parts of the header.

Source: Microsoft, "DDS_PIXELFORMAT structure" and "Programming guide for DDS", documentation of Direct3D.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError
from paradize.files import open_file
from paradize.readers.damage import damaged
from paradize.readers.limits import require_size
from paradize.readers.notes import NARROWED, six_faces

if TYPE_CHECKING:
    from pathlib import Path

_HEAD, _NEWER = 128, 20  # bytes: magic and header; the header behind them where the code is "DX10"
_DX10 = int.from_bytes(b"DX10", "little")
# Flags of a pixel format: the texel has alpha, or nothing else; a code names the format; it is grey.
_ALPHA, _CODE, _LUMINANCE = 0x3, 0x4, 0x20000
_VOLUME, _CUBE = 0x200000, 0x200  # flags of the second word of capabilities
MULTIPLIED, OPAQUE = 2, 3  # modes of alpha: colour is multiplied by it; it means nothing
_FLAT, _NEWER_CUBE = 3, 0x4  # the newer header's dimension of a picture, and its flag of a cube map
# Formats whose texels are plain numbers, by their code in Direct3D 9 and in DXGI: type, channels.
_CODES = {36: ("<u2", 4), 111: ("<f2", 1), 112: ("<f2", 2), 113: ("<f2", 4)}
_CODES |= {114: ("<f4", 1), 115: ("<f4", 2), 116: ("<f4", 4)}
_DXGI = {2: ("<f4", 4), 6: ("<f4", 3), 10: ("<f2", 4), 11: ("<u2", 4), 16: ("<f4", 2), 34: ("<f2", 2)}
_DXGI |= {35: ("<u2", 2), 41: ("<f4", 1), 54: ("<f2", 1), 56: ("<u2", 1)}


class DdsHead(NamedTuple):
    """The parts of a header that decide how texels are read.

    plain: type and number of channels of texels that are plain numbers, which begin at byte `start`; None for
    all others. grey_alpha: whether two channels are grey and alpha, not red and green. note: for the user, or
    "". alpha_mode: that of the newer header, MULTIPLIED or OPAQUE among others.
    """

    width: int = 0
    height: int = 0
    start: int = _HEAD
    plain: tuple[str, int] | None = None
    grey_alpha: bool = False
    note: str = ""
    alpha_mode: int = 0


def dds_head(path: Path, data: bytes) -> DdsHead | None:
    """None for a file that is no DDS. data: its first 148 bytes or more.

    Raises SourceError for volumes and cube maps, and where a channel's bits lie outside its texel, as some
    programs write grey.
    """
    if len(data) < _HEAD or not data.startswith(b"DDS "):
        return None
    height, width = struct.unpack_from("<2I", data, 12)
    flags, code, bits, *masks = struct.unpack_from("<7I", data, 80)
    (capabilities,) = struct.unpack_from("<I", data, 112)
    newer = bool(flags & _CODE) and code == _DX10 and len(data) >= _HEAD + _NEWER
    newest = struct.unpack_from("<5I", data, _HEAD) if newer else (0, _FLAT, 0, 1, 0)
    form, dimension, more, count, modes = newest
    if capabilities & _VOLUME or dimension > _FLAT:
        raise SourceError("a volume texture is not one picture", file=path, mend="save a slice as PNG")
    if capabilities & _CUBE or more & _NEWER_CUBE:
        raise six_faces(path)
    start = _HEAD + (_NEWER if newer else 0)
    if flags & _CODE:
        plain = (_DXGI if newer else _CODES).get(form if newer else code)
        return DdsHead(width, height, start, plain if count <= 1 else None, alpha_mode=modes & 7)
    channels = masks[: 1 if flags & _LUMINANCE else 3] + (masks[3:] if flags & _ALPHA else [])
    used = 0
    for mask in channels:
        used |= mask
    if used >> bits:
        what = f"a channel has bits {used:#x} of a texel of {bits} bits"
        raise SourceError(what, file=path, mend="save it as PNG")
    if channels == [0xFFFF] and bits == 16:
        return DdsHead(width, height, start, ("<u2", 1))
    wide = any(mask.bit_count() > 8 for mask in channels)
    grey_alpha = bool(flags & _LUMINANCE)
    return DdsHead(width, height, start, grey_alpha=grey_alpha, note=NARROWED if wide else "")


def read_plain_dds(path: Path, data: bytes, color_space: str | None) -> Image | None:
    """A picture whose texels are plain numbers of 16 or 32 bits: floats are linear. None for all others.
    data: as of `dds_head`.

    Raises SourceError where it is cut or beyond the limits, and as `dds_head`.
    """
    head = dds_head(path, data)
    if head is None or head.plain is None or not (head.width and head.height):
        return None
    kind, channels = np.dtype(head.plain[0]), head.plain[1]
    require_size(head.width, head.height, channels * kind.itemsize, path)
    count = head.width * head.height * channels
    with open_file(path) as file:
        file.seek(head.start)
        texels = file.read(count * kind.itemsize)
    if len(texels) < count * kind.itemsize:
        raise damaged("the file ends before its picture does", path)
    values = np.frombuffer(texels, kind).reshape(head.height, head.width, channels)
    if channels == 2:  # red and green
        values = np.concatenate([values, np.zeros_like(values[:, :, :1])], axis=2)
    if kind.kind == "u":
        return Image(values.astype(np.uint16), color_space or "srgb", 16, 65535)
    return Image(values.astype(np.float32), color_space or "linear", 8 * kind.itemsize)
