"""KTX2, read: decode_ktx2 is the check's and the tests' eye on our own files.

It is strict: it refuses whatever the writer would not have written, and it never trusts an offset, a length
or what a compressed frame says of itself before it has compared it with the file and the header.
"""

from __future__ import annotations

import struct

from paradize.data import Texture
from paradize.errors import FormatError
from paradize.formats.ktx2.layout import (
    BY_VK,
    FORMATS,
    HEADER,
    HEADER_END,
    IDENTIFIER,
    LEVEL,
    MAX_SIZE,
    NONE,
    ZSTD,
    descriptor,
    full_level_count,
    level_bytes,
    level_start,
)

MAX_INFLATED = 1 << 31  # bytes: 16384 x 16384 texels of RGBA8 with all mips fit
MAX_METADATA = 1 << 16  # bytes: ours takes a hundred
MAX_WINDOW = 1 << 27  # bytes of history that a Zstandard frame may ask for: what its level 22 does


def _read_key_values(data: bytes, at: int, end: int, file: object) -> dict[str, str]:
    """The key/value pairs of data[at:end]. Raises FormatError where they differ from ours."""
    found: dict[str, str] = {}
    last = b""
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
        if key <= last:
            raise FormatError(f"metadata key {name!r:.60} is out of order", file=file, place=place)
        found[name], last = text, key
        padding = data[at + 4 + length : at + 4 + length + -length % 4]
        at += 4 + length + -length % 4
        if at > end or any(padding):
            raise FormatError("metadata padding is not zero", file=file, place=place)
    return found


def _inflated(frame: bytes, expected: int, file: object, place: str) -> bytes:
    """The `expected` bytes in a Zstandard frame. Raises FormatError where it holds anything else; what it
    says of its size is compared before a byte is allocated."""
    import zstandard

    try:
        told = zstandard.get_frame_parameters(frame)
        if told.content_size not in (expected, zstandard.CONTENTSIZE_UNKNOWN) or told.dict_id:
            what = f"its Zstandard frame says {told.content_size} bytes; {expected} belong there"
            raise FormatError(what, file=file, place=place)
        reader = zstandard.ZstdDecompressor(max_window_size=MAX_WINDOW)
        out = reader.decompress(frame, max_output_size=expected, allow_extra_data=False)
    except (zstandard.ZstdError, MemoryError) as error:
        raise FormatError(f"its Zstandard frame is damaged: {error}", file=file, place=place) from error
    if len(out) != expected:
        what = f"its Zstandard frame holds {len(out)} bytes; {expected} belong there"
        raise FormatError(what, file=file, place=place)
    return out


def decode_ktx2(data: bytes, file: object = None, *, most_bytes: int = MAX_INFLATED) -> Texture:
    """The texture in a KTX2 file that Paradize wrote.

    most_bytes: a supercompressed file that claims more is refused before anything is inflated.
    Raises FormatError, with the byte where it is, for anything else: another format, a descriptor that does
    not match the format, an offset or length outside the file, levels missing, overlapping or out of order,
    padding that is not zero, bytes left over, a Zstandard frame that holds another size than its level.
    """
    if len(data) < HEADER_END:
        raise FormatError(f"{len(data)} bytes are no KTX2 file; its header has {HEADER_END}", file=file)
    if data[: len(IDENTIFIER)] != IDENTIFIER:
        raise FormatError("not a KTX2 file: wrong identifier", file=file, place="byte 0")
    (
        vk, type_size, width, height, depth, layers, faces, count, scheme,
        descriptor_at, descriptor_size, key_values_at, key_values_size, global_at, global_size,
    ) = HEADER.unpack_from(data, len(IDENTIFIER))  # fmt: skip
    if vk not in BY_VK:
        raise FormatError(f"vkFormat {vk} is none that Paradize bakes", file=file, place="byte 12")
    name = BY_VK[vk]
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
    if scheme not in (NONE, ZSTD):
        what = f"supercompression scheme {scheme} is not read; none (0) and Zstandard (2) are"
        raise FormatError(what, file=file, place="byte 44")
    if global_at or global_size:
        raise FormatError("global supercompression data; no scheme read has any", file=file, place="byte 64")
    total = sum(level_bytes(name, width, height, level, faces) for level in range(count))
    if scheme and total > most_bytes:
        what = f"{width} x {height} texels inflate to {total} bytes; {most_bytes} is the limit"
        raise FormatError(what, file=file, place="byte 20")

    described = descriptor(fmt, scheme)
    if descriptor_at != HEADER_END + LEVEL.size * count or descriptor_size != len(described):
        raise FormatError("the data format descriptor is not where it belongs", file=file, place="byte 48")
    # Newer writers keep a block's bytes in the descriptor of a supercompressed file too.
    if data[descriptor_at : descriptor_at + descriptor_size] not in (described, descriptor(fmt)):
        raise FormatError(
            f"the data format descriptor is not that of {name}", file=file, place=f"byte {descriptor_at}"
        )
    end = descriptor_at + descriptor_size
    if key_values_size > MAX_METADATA:
        what = f"{key_values_size} bytes of metadata, limit {MAX_METADATA}"
        raise FormatError(what, file=file, place="byte 60")
    if key_values_at != end or key_values_size > len(data) - end:
        raise FormatError("the metadata is not where it belongs", file=file, place="byte 56")
    metadata = _read_key_values(data, end, end + key_values_size, file)
    if metadata.get("KTXorientation") != "rd":
        raise FormatError("KTXorientation is not rd", file=file, place=f"byte {end}")
    end += key_values_size

    levels: list[bytes] = [b""] * count
    for level in reversed(range(count)):
        place = f"level {level}"
        at, size, raw_size = LEVEL.unpack_from(data, HEADER_END + LEVEL.size * level)
        expected = level_bytes(name, width, height, level, faces)
        if raw_size != expected or (size != expected and not scheme):
            told = f"{size} bytes" if raw_size == size else f"{size} bytes, {raw_size} uncompressed"
            raise FormatError(f"{told}; {name} needs {expected}", file=file, place=place)
        start = level_start(end, fmt, scheme)
        if at != start:
            raise FormatError(f"starts at byte {at}, belongs at {start}", file=file, place=place)
        if at + size > len(data):
            raise FormatError(f"ends at byte {at + size} of {len(data)}: file is cut", file=file, place=place)
        if any(data[end:at]):
            raise FormatError("padding is not zero", file=file, place=place)
        end = at + size
        levels[level] = _inflated(data[at:end], expected, file, place) if scheme else data[at:end]
    if end != len(data):
        raise FormatError(f"{len(data) - end} bytes follow the last level", file=file, place=f"byte {end}")
    return Texture(name, width, height, tuple(levels), faces)
