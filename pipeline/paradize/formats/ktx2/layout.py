"""The texel formats of KTX2, their descriptors, and the layout of the file.

Source: The Khronos Group, "KTX File Format Specification, Version 2.0", 2020; data format descriptor:
"Khronos Data Format Specification 1.3", 2019. FORMAT.md describes the bytes.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from math import lcm

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
MAX_SIZE = 32768  # texels per side: twice the limit of desktop hardware
NONE, ZSTD = 0, 2  # supercompression schemes
HEADER = struct.Struct("<9I4I2Q")
LEVEL = struct.Struct("<3Q")
HEADER_END = len(IDENTIFIER) + HEADER.size

_RGBSDA, _BC1A, _BC3, _BC4, _BC5, _BC7 = 1, 128, 130, 131, 132, 134  # colour models
_LINEAR, _SRGB = 1, 2  # transfer functions
_ALPHA, _GREEN = 15, 1
_QUALIFY_LINEAR, _QUALIFY_SIGNED, _QUALIFY_FLOAT = 0x10, 0x40, 0x80


@dataclass(frozen=True)
class Format:
    """A texel format: Vulkan's number, the size of its block, and its descriptor.

    samples: (channel with qualifiers, bit offset, bits, lower, upper) in the order of the descriptor.
    """

    vk: int
    type_size: int
    block: int  # texels per side: 1, or 4 for block compression
    block_bytes: int
    model: int
    transfer: int
    samples: tuple[tuple[int, int, int, int, int], ...]


def _plain(
    vk: int, channels: int, bits: int, *, transfer: int = _LINEAR, signed: bool = False, floats: bool = False
) -> Format:
    """An uncompressed little-endian format with `channels` channels R G B A of `bits` bits each."""
    lower, upper, qualifiers = 0, (1 << bits) - 1, 0
    if signed:
        upper = (1 << (bits - 1)) - 1
        lower, qualifiers = (1 << 32) - upper, _QUALIFY_SIGNED
    if floats:
        lower, upper, qualifiers = 0xBF800000, 0x3F800000, _QUALIFY_SIGNED | _QUALIFY_FLOAT  # -1.0 and 1.0
    samples = []
    for channel in range(channels):
        name = _ALPHA if channel == 3 else channel
        linear_alpha = _QUALIFY_LINEAR if channel == 3 and transfer == _SRGB else 0
        samples.append((name | qualifiers | linear_alpha, channel * bits, bits, lower, upper))
    return Format(
        vk=vk,
        type_size=bits // 8,
        block=1,
        block_bytes=channels * bits // 8,
        model=_RGBSDA,
        transfer=transfer,
        samples=tuple(samples),
    )


def _block(
    vk: int,
    model: int,
    names: tuple[int, ...],
    *,
    transfer: int = _LINEAR,
    signed: bool = False,
    bits: int = 64,
) -> Format:
    """A block-compressed format of 4 x 4 texels with `bits` bits for each named channel."""
    lower, upper = (0x80000000, 0x7FFFFFFF) if signed else (0, 0xFFFFFFFF)
    qualifiers = _QUALIFY_SIGNED if signed else 0
    samples = []
    for index, name in enumerate(names):
        linear_alpha = _QUALIFY_LINEAR if name == _ALPHA and transfer == _SRGB else 0
        samples.append((name | qualifiers | linear_alpha, bits * index, bits, lower, upper))
    return Format(
        vk=vk,
        type_size=1,
        block=4,
        block_bytes=bits // 8 * len(names),
        model=model,
        transfer=transfer,
        samples=tuple(samples),
    )


FORMATS: dict[str, Format] = {
    "BC1_RGB_UNORM": _block(131, _BC1A, (0,)),
    "BC1_RGB_SRGB": _block(132, _BC1A, (0,), transfer=_SRGB),
    "BC3_UNORM": _block(137, _BC3, (_ALPHA, 0)),
    "BC3_SRGB": _block(138, _BC3, (_ALPHA, 0), transfer=_SRGB),
    "BC4_UNORM": _block(139, _BC4, (0,)),
    "BC5_UNORM": _block(141, _BC5, (0, _GREEN)),
    "BC5_SNORM": _block(142, _BC5, (0, _GREEN), signed=True),
    "BC7_UNORM": _block(145, _BC7, (0,), bits=128),
    "BC7_SRGB": _block(146, _BC7, (0,), bits=128, transfer=_SRGB),
    "R8_UNORM": _plain(9, 1, 8),
    "RG8_UNORM": _plain(16, 2, 8),
    "RG8_SNORM": _plain(17, 2, 8, signed=True),
    "RGBA8_UNORM": _plain(37, 4, 8),
    "RGBA8_SRGB": _plain(43, 4, 8, transfer=_SRGB),
    "R16_UNORM": _plain(70, 1, 16),
    "RG16_UNORM": _plain(77, 2, 16),
    "RG16_SNORM": _plain(78, 2, 16, signed=True),
    "RGBA16F": _plain(97, 4, 16, floats=True),
    "R32F": _plain(100, 1, 32, floats=True),
}
BY_VK = {fmt.vk: name for name, fmt in FORMATS.items()}


def full_level_count(width: int, height: int) -> int:
    """The number of levels from width x height texels down to 1 x 1."""
    return max(width, height).bit_length()


def level_bytes(name: str, width: int, height: int, level: int, faces: int = 1) -> int:
    """Bytes of all faces of a level, tightly packed (rows are not padded)."""
    fmt = FORMATS[name]
    across = -(-max(1, width >> level) // fmt.block)
    down = -(-max(1, height >> level) // fmt.block)
    return across * down * fmt.block_bytes * faces


def descriptor(fmt: Format, scheme: int = NONE) -> bytes:
    """The data format descriptor: its total size, then one basic block with a sample per channel.

    With supercompression the field for the bytes of a block is 0, because the stored data have no fixed block
    size.
    """
    block_size = 24 + 16 * len(fmt.samples)
    dimension = fmt.block - 1
    parts = [
        struct.pack("<III", 4 + block_size, 0, 2 | block_size << 16),  # Khronos, basic format; version 1.3
        bytes((fmt.model, 1, fmt.transfer, 0)),  # BT.709 primaries, straight alpha
        bytes((dimension, dimension, 0, 0, 0 if scheme else fmt.block_bytes, 0, 0, 0, 0, 0, 0, 0)),
    ]
    parts += [
        struct.pack("<HBBIII", offset, bits - 1, channel, 0, lower, upper)
        for channel, offset, bits, lower, upper in fmt.samples
    ]
    return b"".join(parts)


def level_start(end: int, fmt: Format, scheme: int) -> int:
    """The offset of a level if the previous one ends at `end`: a multiple of 4 and of the bytes of a block;
    supercompressed levels are not aligned."""
    step = 1 if scheme else lcm(fmt.block_bytes, 4)
    return -(-end // step) * step
