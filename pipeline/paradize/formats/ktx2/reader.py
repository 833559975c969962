"""A strict KTX2 reader for `check` and the tests.

It refuses everything that the writer would not write. It compares all offsets, lengths and sizes declared by
compressed frames with the file and the header before it uses them.
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

MAX_UNCOMPRESSED = 1 << 31  # bytes: enough for 16384 x 16384 texels of RGBA8 with all mips
MAX_METADATA = 1 << 16  # bytes: ours has about a hundred
MAX_WINDOW = 1 << 27  # bytes of history that a Zstandard frame may need, as at level 22


def _read_key_values(data: bytes, position: int, end: int, file: object) -> dict[str, str]:
    """The key/value pairs of data[position:end]. Raises FormatError where they are not as we write them."""
    entries: dict[str, str] = {}
    previous = b""
    while position < end:
        place = f"byte {position}"
        if end - position < 4:
            raise FormatError("metadata entry is truncated", file=file, place=place)
        (length,) = struct.unpack_from("<I", data, position)
        if not 2 <= length <= end - position - 4:
            raise FormatError(
                f"metadata entry of {length} bytes; {end - position - 4} are left", file=file, place=place
            )
        key, zero, value = data[position + 4 : position + 4 + length].partition(b"\0")
        if not (key and zero and value.endswith(b"\0")) or b"\0" in value[:-1]:
            raise FormatError("metadata entry is not a key and a text", file=file, place=place)
        try:
            name, text = key.decode(), value[:-1].decode()
        except UnicodeDecodeError as error:
            raise FormatError("metadata is not UTF-8", file=file, place=place) from error
        if key <= previous:
            raise FormatError(f"metadata key {name!r:.60} is out of order", file=file, place=place)
        entries[name], previous = text, key
        padding = data[position + 4 + length : position + 4 + length + -length % 4]
        position += 4 + length + -length % 4
        if position > end or any(padding):
            raise FormatError("metadata padding is not zero", file=file, place=place)
    return entries


def _decompressed(frame: bytes, expected: int, file: object, place: str) -> bytes:
    """The `expected` bytes of a Zstandard frame. Raises FormatError for any other content; the declared size
    is compared before memory is allocated."""
    import zstandard

    try:
        parameters = zstandard.get_frame_parameters(frame)
        if parameters.content_size not in (expected, zstandard.CONTENTSIZE_UNKNOWN) or parameters.dict_id:
            what = f"its Zstandard frame declares {parameters.content_size} bytes; expected {expected}"
            raise FormatError(what, file=file, place=place)
        reader = zstandard.ZstdDecompressor(max_window_size=MAX_WINDOW)
        raw = reader.decompress(frame, max_output_size=expected, allow_extra_data=False)
    except (zstandard.ZstdError, MemoryError) as error:
        raise FormatError(f"its Zstandard frame is damaged: {error}", file=file, place=place) from error
    if len(raw) != expected:
        what = f"its Zstandard frame holds {len(raw)} bytes; expected {expected}"
        raise FormatError(what, file=file, place=place)
    return raw


def decode_ktx2(data: bytes, file: object = None, *, most_bytes: int = MAX_UNCOMPRESSED) -> Texture:
    """Reads a KTX2 file that Paradize wrote.

    most_bytes: a supercompressed file that declares more is refused before it is decompressed. Raises
    FormatError, with the byte offset, for everything else: another format, a wrong descriptor, offsets or
    lengths outside the file, missing or overlapping levels, padding that is not zero, extra bytes, Zstandard
    frames of the wrong size.
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
        raise FormatError(f"vkFormat {vk} is not one that Paradize bakes", file=file, place="byte 12")
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
        what = f"supercompression scheme {scheme}; expected none (0) or Zstandard (2)"
        raise FormatError(what, file=file, place="byte 44")
    if global_at or global_size:
        raise FormatError("global supercompression data; expected none", file=file, place="byte 64")
    total = sum(level_bytes(name, width, height, level, faces) for level in range(count))
    if scheme and total > most_bytes:
        what = f"{width} x {height} texels have {total} bytes uncompressed, limit {most_bytes}"
        raise FormatError(what, file=file, place="byte 20")

    descriptor_bytes = descriptor(fmt, scheme)
    if descriptor_at != HEADER_END + LEVEL.size * count or descriptor_size != len(descriptor_bytes):
        raise FormatError("the data format descriptor is not at its place", file=file, place="byte 48")
    # Newer writers keep the bytes of a block in the descriptor of supercompressed files as well.
    if data[descriptor_at : descriptor_at + descriptor_size] not in (descriptor_bytes, descriptor(fmt)):
        raise FormatError(
            f"the data format descriptor is not that of {name}", file=file, place=f"byte {descriptor_at}"
        )
    end = descriptor_at + descriptor_size
    if key_values_size > MAX_METADATA:
        what = f"{key_values_size} bytes of metadata, limit {MAX_METADATA}"
        raise FormatError(what, file=file, place="byte 60")
    if key_values_at != end or key_values_size > len(data) - end:
        raise FormatError("the metadata is not at its place", file=file, place="byte 56")
    metadata = _read_key_values(data, end, end + key_values_size, file)
    if metadata.get("KTXorientation") != "rd":
        raise FormatError("KTXorientation is not rd", file=file, place=f"byte {end}")
    end += key_values_size

    levels: list[bytes] = [b""] * count
    for level in reversed(range(count)):
        place = f"level {level}"
        offset, size, raw_size = LEVEL.unpack_from(data, HEADER_END + LEVEL.size * level)
        expected = level_bytes(name, width, height, level, faces)
        if raw_size != expected or (size != expected and not scheme):
            sizes = f"{size} bytes" if raw_size == size else f"{size} bytes, {raw_size} uncompressed"
            raise FormatError(f"{sizes}; {name} needs {expected}", file=file, place=place)
        start = level_start(end, fmt, scheme)
        if offset != start:
            raise FormatError(f"starts at byte {offset}, expected {start}", file=file, place=place)
        if offset + size > len(data):
            raise FormatError(
                f"ends at byte {offset + size} of {len(data)}: it is truncated", file=file, place=place
            )
        if any(data[end:offset]):
            raise FormatError("padding is not zero", file=file, place=place)
        end = offset + size
        levels[level] = _decompressed(data[offset:end], expected, file, place) if scheme else data[offset:end]
    if end != len(data):
        raise FormatError(f"{len(data) - end} bytes follow the last level", file=file, place=f"byte {end}")
    return Texture(name, width, height, tuple(levels), faces)
