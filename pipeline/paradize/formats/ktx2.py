"""KTX2 textures: encode_ktx2 writes them, decode_ktx2 reads back exactly what encode_ktx2 writes.

Source: The Khronos Group, "KTX File Format Specification, Version 2.0", 2020; the data format descriptor
follows "Khronos Data Format Specification 1.3", 2019. The byte layout is told in FORMAT.md.

The reader is strict: it is the check's and the tests' eye on our own files, so it refuses whatever the writer
would not have written, and it never trusts an offset or a length before it has compared it with the file.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from math import lcm
from typing import TYPE_CHECKING

from paradize.data import Texture
from paradize.errors import FormatError

if TYPE_CHECKING:
    from collections.abc import Mapping

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
MAX_SIZE = 32768  # texels per side: twice what desktop hardware takes
_HEADER = struct.Struct("<9I4I2Q")
_LEVEL = struct.Struct("<3Q")
_HEADER_END = len(IDENTIFIER) + _HEADER.size

_RGBSDA, _BC1A, _BC3, _BC4, _BC5 = 1, 128, 130, 131, 132  # colour models of the data format specification
_LINEAR, _SRGB = 1, 2  # its transfer functions
_ALPHA, _GREEN = 15, 1
_QUALIFY_LINEAR, _QUALIFY_SIGNED, _QUALIFY_FLOAT = 0x10, 0x40, 0x80


@dataclass(frozen=True)
class Format:
    """A texel format: how Vulkan numbers it, how large its block is, and how its descriptor reads.

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
    """An uncompressed little-endian format of `channels` channels R G B A with `bits` bits each."""
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
    return Format(vk, bits // 8, 1, channels * bits // 8, _RGBSDA, transfer, tuple(samples))


def _block(
    vk: int, model: int, names: tuple[int, ...], *, transfer: int = _LINEAR, signed: bool = False
) -> Format:
    """A block-compressed format of 4 x 4 texels, 64 bits for every channel named."""
    lower, upper = (0x80000000, 0x7FFFFFFF) if signed else (0, 0xFFFFFFFF)
    qualifiers = _QUALIFY_SIGNED if signed else 0
    samples = []
    for index, name in enumerate(names):
        linear_alpha = _QUALIFY_LINEAR if name == _ALPHA and transfer == _SRGB else 0
        samples.append((name | qualifiers | linear_alpha, 64 * index, 64, lower, upper))
    return Format(vk, 1, 4, 8 * len(names), model, transfer, tuple(samples))


FORMATS: dict[str, Format] = {
    "BC1_RGB_UNORM": _block(131, _BC1A, (0,)),
    "BC1_RGB_SRGB": _block(132, _BC1A, (0,), transfer=_SRGB),
    "BC3_UNORM": _block(137, _BC3, (_ALPHA, 0)),
    "BC3_SRGB": _block(138, _BC3, (_ALPHA, 0), transfer=_SRGB),
    "BC4_UNORM": _block(139, _BC4, (0,)),
    "BC5_UNORM": _block(141, _BC5, (0, _GREEN)),
    "BC5_SNORM": _block(142, _BC5, (0, _GREEN), signed=True),
    "R8_UNORM": _plain(9, 1, 8),
    "RG8_UNORM": _plain(16, 2, 8),
    "RG8_SNORM": _plain(17, 2, 8, signed=True),
    "RGBA8_UNORM": _plain(37, 4, 8),
    "RGBA8_SRGB": _plain(43, 4, 8, transfer=_SRGB),
    "R16_UNORM": _plain(70, 1, 16),
    "RGBA16F": _plain(97, 4, 16, floats=True),
    "R32F": _plain(100, 1, 32, floats=True),
}
_BY_VK = {fmt.vk: name for name, fmt in FORMATS.items()}


def full_level_count(width: int, height: int) -> int:
    """Levels of a chain from width x height texels down to 1 x 1."""
    return max(width, height).bit_length()


def level_bytes(name: str, width: int, height: int, level: int, faces: int = 1) -> int:
    """Bytes of one level of all faces, tightly packed (no row is padded)."""
    fmt = FORMATS[name]
    across = -(-max(1, width >> level) // fmt.block)
    down = -(-max(1, height >> level) // fmt.block)
    return across * down * fmt.block_bytes * faces


def _descriptor(fmt: Format) -> bytes:
    """The data format descriptor: its total size, then one basic block with a sample per channel."""
    block_size = 24 + 16 * len(fmt.samples)
    dimension = fmt.block - 1
    parts = [
        struct.pack("<III", 4 + block_size, 0, 2 | block_size << 16),  # Khronos, basic format; version 1.3
        bytes((fmt.model, 1, fmt.transfer, 0)),  # BT.709 primaries, straight alpha
        bytes((dimension, dimension, 0, 0, fmt.block_bytes, 0, 0, 0, 0, 0, 0, 0)),
    ]
    parts += [
        struct.pack("<HBBIII", offset, bits - 1, channel, 0, lower, upper)
        for channel, offset, bits, lower, upper in fmt.samples
    ]
    return b"".join(parts)


def _key_values(metadata: Mapping[str, str]) -> bytes:
    """The key/value data, sorted by key as the specification asks; every value ends in a zero byte."""
    out = bytearray()
    for key in sorted(metadata, key=lambda k: k.encode()):
        entry = key.encode() + b"\0" + metadata[key].encode() + b"\0"
        out += struct.pack("<I", len(entry)) + entry + bytes(-len(entry) % 4)
    return bytes(out)


def _aligned(offset: int, alignment: int) -> int:
    return offset + -offset % alignment


def encode_ktx2(texture: Texture, metadata: Mapping[str, str] | None = None) -> bytes:
    """A KTX2 file that holds the texture: smallest level first, so that a prefix of the file draws.

    metadata adds to (or replaces) KTXorientation "rd" and KTXwriter "paradize"; keys and values hold no zero
    byte. Raises FormatError when the format is unknown or the levels' sizes do not fit it.
    """
    fmt = FORMATS.get(texture.format)
    if fmt is None:
        raise FormatError(f"unknown texture format {texture.format!r}", mend=f"one of {', '.join(FORMATS)}")
    width, height, faces, count = texture.width, texture.height, texture.faces, len(texture.levels)
    if not (1 <= width <= MAX_SIZE and 1 <= height <= MAX_SIZE):
        raise FormatError(f"texture of {width} x {height} texels; 1 to {MAX_SIZE} per side are written")
    if faces not in (1, 6) or (faces == 6 and width != height):
        raise FormatError(f"{faces} faces of {width} x {height}; one, or six square ones, are written")
    if not 1 <= count <= full_level_count(width, height):
        raise FormatError(
            f"{count} levels, but {width} x {height} texels have {full_level_count(width, height)}"
        )
    for level, data in enumerate(texture.levels):
        expected = level_bytes(texture.format, width, height, level, faces)
        if len(data) != expected:
            raise FormatError(f"level {level} holds {len(data)} bytes; {texture.format} needs {expected}")

    descriptor = _descriptor(fmt)
    key_values = _key_values({"KTXorientation": "rd", "KTXwriter": "paradize", **(metadata or {})})
    descriptor_at = _HEADER_END + _LEVEL.size * count
    key_values_at = descriptor_at + len(descriptor)
    alignment = lcm(fmt.block_bytes, 4)
    offsets = [0] * count
    end = key_values_at + len(key_values)
    for level in reversed(range(count)):
        offsets[level] = _aligned(end, alignment)
        end = offsets[level] + len(texture.levels[level])

    out = bytearray(end)
    out[: len(IDENTIFIER)] = IDENTIFIER
    _HEADER.pack_into(
        out, len(IDENTIFIER),
        fmt.vk, fmt.type_size, width, height, 0, 0, faces, count, 0,
        descriptor_at, len(descriptor), key_values_at, len(key_values), 0, 0,
    )  # fmt: skip
    for level, data in enumerate(texture.levels):
        _LEVEL.pack_into(out, _HEADER_END + _LEVEL.size * level, offsets[level], len(data), len(data))
        out[offsets[level] : offsets[level] + len(data)] = data
    out[descriptor_at:key_values_at] = descriptor
    out[key_values_at : key_values_at + len(key_values)] = key_values
    return bytes(out)


def _read_key_values(data: bytes, at: int, end: int, file: object) -> dict[str, str]:
    """The key/value pairs of data[at:end]. Raises FormatError where they differ from ours."""
    found: dict[str, str] = {}
    while at < end:
        place = f"byte {at}"
        if end - at < 4:
            raise FormatError("metadata entry is cut", file=file, place=place)
        (length,) = struct.unpack_from("<I", data, at)
        if not 2 <= length <= end - at - 4:
            raise FormatError(
                f"metadata entry of {length} bytes; {end - at - 4} are left", file=file, place=place
            )
        key, zero, value = data[at + 4 : at + 4 + length].partition(b"\0")
        if not (key and zero and value.endswith(b"\0")) or b"\0" in value[:-1]:
            raise FormatError("metadata entry is not a key and a text", file=file, place=place)
        try:
            name, text = key.decode(), value[:-1].decode()
        except UnicodeDecodeError as error:
            raise FormatError("metadata is not UTF-8", file=file, place=place) from error
        if found and name.encode() <= list(found)[-1].encode():
            raise FormatError(f"metadata key {name!r} is out of order", file=file, place=place)
        found[name] = text
        padding = data[at + 4 + length : at + 4 + length + -length % 4]
        at += 4 + length + -length % 4
        if at > end or any(padding):
            raise FormatError("metadata padding is not zero", file=file, place=place)
    return found


def decode_ktx2(data: bytes, file: object = None) -> Texture:
    """The texture in a KTX2 file that Paradize wrote.

    Raises FormatError, with the byte where it is, for anything else: another format, a descriptor that does
    not match the format, an offset or length outside the file, levels missing, overlapping or out of order,
    padding that is not zero, bytes left over.
    """
    if len(data) < _HEADER_END:
        raise FormatError(f"{len(data)} bytes are no KTX2 file; its header has {_HEADER_END}", file=file)
    if data[: len(IDENTIFIER)] != IDENTIFIER:
        raise FormatError("not a KTX2 file: wrong identifier", file=file, place="byte 0")
    (
        vk, type_size, width, height, depth, layers, faces, count, scheme,
        descriptor_at, descriptor_size, key_values_at, key_values_size, global_at, global_size,
    ) = _HEADER.unpack_from(data, len(IDENTIFIER))  # fmt: skip
    if vk not in _BY_VK:
        raise FormatError(f"vkFormat {vk} is none that Paradize bakes", file=file, place="byte 12")
    name = _BY_VK[vk]
    fmt = FORMATS[name]
    if type_size != fmt.type_size:
        raise FormatError(f"typeSize {type_size}; {name} has {fmt.type_size}", file=file, place="byte 16")
    if not (1 <= width <= MAX_SIZE and 1 <= height <= MAX_SIZE) or depth or layers:
        what = f"{width} x {height} x {depth} texels in {layers} layers; 1 to {MAX_SIZE} per side, no layers"
        raise FormatError(what, file=file, place="byte 20")
    if faces not in (1, 6) or (faces == 6 and width != height):
        raise FormatError(f"{faces} faces of {width} x {height} texels", file=file, place="byte 36")
    if not 1 <= count <= full_level_count(width, height):
        raise FormatError(f"{count} levels of {width} x {height} texels", file=file, place="byte 40")
    if scheme:
        raise FormatError(f"supercompression scheme {scheme} is not read", file=file, place="byte 44")
    if global_at or global_size:
        raise FormatError("supercompression data without supercompression", file=file, place="byte 64")

    descriptor = _descriptor(fmt)
    if descriptor_at != _HEADER_END + _LEVEL.size * count or descriptor_size != len(descriptor):
        raise FormatError("the data format descriptor is not where it belongs", file=file, place="byte 48")
    if data[descriptor_at : descriptor_at + descriptor_size] != descriptor:
        raise FormatError(
            f"the data format descriptor is not that of {name}", file=file, place=f"byte {descriptor_at}"
        )
    end = descriptor_at + descriptor_size
    if key_values_at != end or key_values_size > len(data) - end:
        raise FormatError("the metadata is not where it belongs", file=file, place="byte 56")
    metadata = _read_key_values(data, end, end + key_values_size, file)
    if metadata.get("KTXorientation") != "rd":
        raise FormatError("KTXorientation is not rd", file=file, place=f"byte {end}")
    end += key_values_size

    levels: list[bytes] = [b""] * count
    for level in reversed(range(count)):
        place = f"level {level}"
        at, size, raw_size = _LEVEL.unpack_from(data, _HEADER_END + _LEVEL.size * level)
        expected = level_bytes(name, width, height, level, faces)
        if size != expected or raw_size != expected:
            raise FormatError(f"{size} bytes; {name} needs {expected}", file=file, place=place)
        start = _aligned(end, lcm(fmt.block_bytes, 4))
        if at != start:
            raise FormatError(f"starts at byte {at}, belongs at {start}", file=file, place=place)
        if at + size > len(data):
            raise FormatError(f"ends at byte {at + size} of {len(data)}: file is cut", file=file, place=place)
        if any(data[end:at]):
            raise FormatError("padding is not zero", file=file, place=place)
        levels[level] = data[at : at + size]
        end = at + size
    if end != len(data):
        raise FormatError(f"{len(data) - end} bytes follow the last level", file=file, place=f"byte {end}")
    return Texture(name, width, height, tuple(levels), faces)
