"""Promises of the KTX2 writer and reader."""

from __future__ import annotations

import struct
import subprocess
import sys
from itertools import pairwise
from math import lcm
from pathlib import Path

import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.data import Texture
from paradize.errors import FormatError
from paradize.formats.ktx2.cut import can_cut, cut_ktx2
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.layout import FORMATS, full_level_count, level_bytes
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.ktx2.size import SIZE_BYTES, ktx2_size
from tests.sweeps import tries


def make_texture(name: str, width: int, height: int, faces: int = 1, count: int | None = None) -> Texture:
    """A texture whose every level holds bytes of its own."""
    count = full_level_count(width, height) if count is None else count
    sizes = [level_bytes(name, width, height, level, faces) for level in range(count)]
    levels = tuple(bytes((17 * level + 3 * i) % 251 for i in range(size)) for level, size in enumerate(sizes))
    return Texture(name, width, height, levels, faces)


def test_golden_header_reads_as_the_specification_numbers_it() -> None:
    data = encode_ktx2(make_texture("BC1_RGB_SRGB", 8, 4))
    head = bytes.fromhex("ab4b5458203230bb0d0a1a0a")
    assert data[:12] == head
    assert struct.unpack_from("<9I", data, 12) == (132, 1, 8, 4, 0, 0, 1, 4, 0)
    descriptor_at, descriptor_size, keys_at, keys_size = struct.unpack_from("<4I", data, 48)
    assert (descriptor_at, descriptor_size) == (80 + 4 * 24, 44)
    words = struct.unpack_from("<11I", data, descriptor_at)
    # total; Khronos basic; version 2, 40 bytes; BC1A, BT.709, sRGB; 4 x 4; 8 bytes; one sample of 64 bits
    assert words == (44, 0, 2 | 40 << 16, 128 | 1 << 8 | 2 << 16, 0x0303, 8, 0, 63 << 16, 0, 0, 0xFFFFFFFF)
    assert data[keys_at : keys_at + keys_size] == (
        struct.pack("<I", 18)
        + b"KTXorientation\0rd\0\0\0"
        + struct.pack("<I", 19)
        + b"KTXwriter\0paradize\0\0"
    )
    offsets = [struct.unpack_from("<3Q", data, 80 + 24 * level)[0] for level in range(4)]
    assert offsets == sorted(offsets, reverse=True), "the smallest level comes first in the file"


@pytest.mark.parametrize("zstd_level", [None, 3])
def test_without_its_finest_levels_a_texture_is_packed_as_before(zstd_level: int | None) -> None:
    whole = make_texture("BC5_SNORM", 64, 32)
    coarse = Texture("BC5_SNORM", 16, 8, whole.levels[2:], 1)
    cut = cut_ktx2(encode_ktx2(whole, zstd_level=zstd_level), 2, zstd_level=3)
    assert cut == encode_ktx2(coarse, zstd_level=zstd_level)


@pytest.mark.parametrize(
    ("width", "height", "fmt", "finer", "can"),
    [
        (16, 16, "BC1_RGB_SRGB", 2, True),
        (8, 8, "BC1_RGB_SRGB", 2, False),
        (16, 8, "BC7_SRGB", 2, False),
        (24, 16, "BC5_SNORM", 2, False),
        (8, 4, "RGBA8_SRGB", 2, True),
        (6, 8, "RGBA8_SRGB", 2, False),
    ],
)
def test_a_cut_texture_keeps_whole_sides_and_with_blocks_multiples_of_four(
    width: int, height: int, fmt: str, finer: int, can: bool
) -> None:
    assert can_cut(width, height, fmt, finer) == can


# vkFormat, typeSize, colour model, bytes of a block, and of each sample: channel and qualifiers, offset,
# bits, lower, upper. Written down from the data format specification, not from the code.
DESCRIPTORS = {
    "BC7_SRGB": (146, 1, 134, 16, [(0, 0, 128, 0, 0xFFFFFFFF)]),
    "BC7_UNORM": (145, 1, 134, 16, [(0, 0, 128, 0, 0xFFFFFFFF)]),
    "BC5_SNORM": (
        142, 1, 132, 16, [(0x40, 0, 64, 0x80000000, 0x7FFFFFFF), (0x41, 64, 64, 0x80000000, 0x7FFFFFFF)],
    ),
    "R16_UNORM": (70, 2, 1, 2, [(0, 0, 16, 0, 65535)]),
    "RG16_UNORM": (77, 2, 1, 4, [(0, 0, 16, 0, 65535), (1, 16, 16, 0, 65535)]),
    "RG16_SNORM": (78, 2, 1, 4, [(0x40, 0, 16, 2**32 - 32767, 32767), (0x41, 16, 16, 2**32 - 32767, 32767)]),
    "RG8_SNORM": (17, 1, 1, 2, [(0x40, 0, 8, 2**32 - 127, 127), (0x41, 8, 8, 2**32 - 127, 127)]),
    "RGBA16F": (
        97, 2, 1, 8, [(0xC0 | c, 16 * i, 16, 0xBF800000, 0x3F800000) for i, c in enumerate((0, 1, 2, 15))],
    ),
    "RGBA8_SRGB": (43, 1, 1, 4, [(c, 8 * i, 8, 0, 255) for i, c in enumerate((0, 1, 2, 0x1F))]),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(DESCRIPTORS))
@pytest.mark.parametrize("zstd_level", [None, 3])
def test_descriptors_read_as_the_specification_numbers_them(name: str, zstd_level: int | None) -> None:
    vk, type_size, model, block_bytes, samples = DESCRIPTORS[name]
    data = encode_ktx2(make_texture(name, 8, 8), zstd_level=zstd_level)
    assert struct.unpack_from("<2I", data, 12) == (vk, type_size)
    at, size = struct.unpack_from("<2I", data, 48)
    words = struct.unpack_from(f"<{size // 4}I", data, at)
    assert words[0] == size == 28 + 16 * len(samples)
    assert words[2] == 2 | (size - 4) << 16
    assert words[3] == model | 1 << 8 | (2 if name.endswith("SRGB") else 1) << 16
    assert words[4] == (0x0303 if name.startswith("BC") else 0)
    assert words[5:7] == (0 if zstd_level else block_bytes, 0)
    for index, (channel, offset, bits, lower, upper) in enumerate(samples):
        found = words[7 + 4 * index : 11 + 4 * index]
        assert found == (offset | (bits - 1) << 16 | channel << 24, 0, lower, upper)


@pytest.mark.parametrize("name", sorted(FORMATS))
@pytest.mark.parametrize("faces", [1, 6])
@pytest.mark.parametrize("zstd_level", [None, 1, 19])
def test_every_format_comes_back_as_it_went(name: str, faces: int, zstd_level: int | None) -> None:
    texture = make_texture(name, 20, 20, faces)
    assert decode_ktx2(encode_ktx2(texture, zstd_level=zstd_level)) == texture


@settings(deadline=None, max_examples=tries(60))
@given(
    st.sampled_from(sorted(FORMATS)),
    st.integers(1, 40),
    st.integers(1, 40),
    st.integers(1, 6),
    st.booleans(),
    st.sampled_from([None, None, 1, 9]),
)
def test_any_size_and_any_chain_comes_back(
    name: str, width: int, height: int, count: int, cube: bool, zstd_level: int | None
) -> None:
    height = width if cube else height
    texture = make_texture(name, width, height, 6 if cube else 1, min(count, full_level_count(width, height)))
    data = encode_ktx2(texture, zstd_level=zstd_level)
    assert decode_ktx2(data) == texture
    entries = [struct.unpack_from("<3Q", data, 80 + 24 * level) for level in range(len(texture.levels))]
    assert [raw for _, _, raw in entries] == [len(level) for level in texture.levels]
    if zstd_level is None:
        alignment = lcm({1: 1, 2: 2, 4: 4, 8: 8, 16: 16}[FORMATS[name].block_bytes], 4)
        assert all(at % alignment == 0 for at, _, _ in entries)
    else:
        assert all(
            at == finer_at + finer_size for (at, _, _), (finer_at, finer_size, _) in pairwise(entries)
        ), "no padding between supercompressed levels"


def test_a_file_cut_at_any_byte_is_refused() -> None:
    data = encode_ktx2(make_texture("BC5_SNORM", 8, 4))
    for length in range(len(data)):
        with pytest.raises(FormatError):
            decode_ktx2(data[:length], "cut.ktx2")


def test_a_changed_byte_anywhere_before_the_texels_is_refused() -> None:
    data = encode_ktx2(make_texture("BC4_UNORM", 8, 8))
    texels = struct.unpack_from("<Q", data, 80 + 24 * 3)[0]
    keys_at = struct.unpack_from("<I", data, 56)[0]
    writer = data.index(b"paradize")
    for at in range(texels):
        if keys_at <= at and (writer <= at < writer + 8 or data[at : at + 1].isalpha()):
            continue  # a letter of a key or a text may change without harm
        broken = bytearray(data)
        broken[at] ^= 0x81
        with pytest.raises(FormatError):
            decode_ktx2(bytes(broken), "broken.ktx2")


def test_bytes_after_the_last_level_are_refused() -> None:
    with pytest.raises(FormatError, match="follow the last level"):
        decode_ktx2(encode_ktx2(make_texture("R8_UNORM", 4, 4)) + b"\0", "long.ktx2")


def test_metadata_is_sorted_and_out_of_order_refused() -> None:
    texture = make_texture("R8_UNORM", 2, 2)
    data = encode_ktx2(texture, {"a": "last", "Paradize": "é"})
    pairs = ("KTXorientation\0rd\0", "KTXwriter\0paradize\0", "Paradize\0é\0", "a\0last\0")
    places = [data.index(pair.encode()) for pair in pairs]
    assert places == sorted(places)
    assert decode_ktx2(data) == texture
    with pytest.raises(FormatError, match="out of order"):
        decode_ktx2(data.replace(b"Paradize\0", b"zaradize\0"))


@pytest.mark.parametrize(
    "texture",
    [
        Texture("BC9", 4, 4, (b"",)),
        Texture("R8_UNORM", 0, 4, (b"",)),
        Texture("R8_UNORM", 2, 2, (b"123",)),
        Texture("R8_UNORM", 2, 2, ()),
        Texture("R8_UNORM", 2, 2, (b"1234", b"1", b"1")),
        Texture("R8_UNORM", 2, 1, (b"12" * 6,), 6),
        Texture("R8_UNORM", 2, 2, (b"12",), 2),
    ],
)
def test_a_texture_that_is_none_is_refused(texture: Texture) -> None:
    with pytest.raises(FormatError):
        encode_ktx2(texture)


def test_foreign_files_are_read_where_we_know_the_format_and_refused_elsewhere(corpus: Path) -> None:
    files = sorted((corpus / "malformed").glob("ktx2-*/*.ktx2"))
    assert files
    read = {}
    for path in files:
        try:
            texture = decode_ktx2(path.read_bytes(), path.name)
        except FormatError as error:
            assert path.name in str(error)
        else:
            read[path.name] = (texture.format, texture.width, texture.height)
    # Written by the Khronos tools: their descriptors are byte for byte what we write for these formats.
    assert read["2d-compressed-bc5.ktx2"] == ("BC5_SNORM", 3, 2)
    assert read["rg_reference_u.ktx2"] == ("RG8_UNORM", 32, 32)
    assert read["r_reference_u.ktx2"] == ("R8_UNORM", 200, 100)
    assert read["tbyn3p08.ktx2"] == ("RGBA8_UNORM", 32, 32)


@pytest.mark.parametrize("name", sorted(DESCRIPTORS))
def test_a_file_written_down_from_the_specification_is_read(name: str) -> None:
    """As another writer may: one key alone, and of the levels the smallest first."""
    vk, type_size, model, block_bytes, samples = DESCRIPTORS[name]
    texture = make_texture(name, 8, 8)
    transfer = 2 if name.endswith("SRGB") else 1
    words = [28 + 16 * len(samples), 0, 2 | (24 + 16 * len(samples)) << 16, model | 1 << 8 | transfer << 16]
    words += [0x0303 if name.startswith("BC") else 0, block_bytes, 0]
    for channel, offset, bits, lower, upper in samples:
        words += [offset | (bits - 1) << 16 | channel << 24, 0, lower, upper]
    descriptor = struct.pack(f"<{len(words)}I", *words)
    keys = struct.pack("<I", 18) + b"KTXorientation\0rd\0\0\0"
    count = len(texture.levels)
    at = 80 + 24 * count
    head = bytes.fromhex("ab4b5458203230bb0d0a1a0a")
    head += struct.pack("<9I", vk, type_size, 8, 8, 0, 0, 1, count, 0)
    head += struct.pack("<4I2Q", at, len(descriptor), at + len(descriptor), len(keys), 0, 0)
    at += len(descriptor) + len(keys)
    body, index = b"", []
    for level in reversed(texture.levels):
        body += b"\0" * (-(at + len(body)) % lcm(block_bytes, 4))
        index.insert(0, struct.pack("<3Q", at + len(body), len(level), len(level)))
        body += level
    assert decode_ktx2(head + b"".join(index) + descriptor + keys + body) == texture


def zstd_file(texture: Texture) -> bytearray:
    return bytearray(encode_ktx2(texture, zstd_level=3))


def with_frame(texture: Texture, frame: bytes) -> bytes:
    """The one-level file of a texture with another frame in it."""
    data = zstd_file(texture)
    at = struct.unpack_from("<Q", data, 80)[0]
    struct.pack_into("<Q", data, 88, len(frame))
    return bytes(data[:at]) + frame


ONE = make_texture("R8_UNORM", 64, 64, count=1)
BAD_FRAMES = {
    "nothing": b"",
    "no frame": b"just some bytes",
    "a skippable frame": struct.pack("<II", 0x184D2A50, 4) + b"skip",
    "one byte short": zstandard.ZstdCompressor().compress(ONE.levels[0][:-1]),
    "one byte long": zstandard.ZstdCompressor().compress(ONE.levels[0] + b"x"),
    "a bomb that says so": zstandard.ZstdCompressor().compress(bytes(1 << 24)),
    "a bomb of unknown size": zstandard.ZstdCompressor(write_content_size=False).compress(bytes(1 << 24)),
    "two frames": zstandard.ZstdCompressor().compress(ONE.levels[0]) * 2,
    "bytes after the frame": zstandard.ZstdCompressor().compress(ONE.levels[0]) + b"after",
    "a frame of a dictionary": zstandard.ZstdCompressor(
        dict_data=zstandard.ZstdCompressionDict(b"0123456789" * 8, zstandard.DICT_TYPE_RAWCONTENT)
    ).compress(b"0123456789" * 409 + b"abcdef")[:-9],
}


@pytest.mark.parametrize("what", sorted(BAD_FRAMES))
def test_a_frame_that_is_not_the_level_s_is_refused_with_its_place(what: str) -> None:
    with pytest.raises(FormatError, match=r"bad\.ktx2: level 0: "):
        decode_ktx2(with_frame(ONE, BAD_FRAMES[what]), "bad.ktx2")


def test_a_frame_without_its_size_is_read_where_it_fits() -> None:
    frame = zstandard.ZstdCompressor(write_content_size=False).compress(ONE.levels[0])
    assert decode_ktx2(with_frame(ONE, frame)) == ONE


def test_a_lie_about_the_uncompressed_length_is_refused() -> None:
    data = zstd_file(ONE)
    for lie in (0, 1, 4095, 4097, 1 << 40, (1 << 64) - 1):
        struct.pack_into("<Q", data, 96, lie)
        with pytest.raises(FormatError, match=f"{lie} uncompressed; R8_UNORM needs 4096"):
            decode_ktx2(bytes(data), "lie.ktx2")


def test_a_file_that_would_inflate_beyond_the_limit_is_refused_before_it_does() -> None:
    """A header of 32768 x 32768 half floats, 8 GiB, in 300 bytes; and a limit of one's own."""
    data = zstd_file(make_texture("RGBA16F", 4, 4, count=1))
    struct.pack_into("<2I", data, 20, 32768, 32768)
    struct.pack_into("<Q", data, 96, 32768 * 32768 * 8)
    with pytest.raises(FormatError, match=r"8589934592 bytes uncompressed, limit 2147483648"):
        decode_ktx2(bytes(data), "bomb.ktx2")
    with pytest.raises(FormatError, match="4096 bytes uncompressed, limit 4095"):
        decode_ktx2(bytes(zstd_file(ONE)), most_bytes=4095)
    assert decode_ktx2(bytes(zstd_file(ONE)), most_bytes=4096) == ONE


def test_any_changed_byte_of_a_supercompressed_file_is_refused_or_harmless() -> None:
    texture = make_texture("RG8_SNORM", 16, 16)
    data = zstd_file(texture)
    sizes = [len(level) for level in texture.levels]
    for at in range(len(data)):
        for flip in (0x01, 0x80, 0xFF):
            broken = bytearray(data)
            broken[at] ^= flip
            try:
                read = decode_ktx2(bytes(broken), "broken.ktx2")
            except FormatError:
                continue
            assert [len(level) for level in read.levels] == sizes


def test_a_supercompressed_file_cut_at_any_byte_is_refused() -> None:
    data = bytes(zstd_file(make_texture("BC7_SRGB", 16, 8)))
    for length in range(len(data)):
        with pytest.raises(FormatError):
            decode_ktx2(data[:length], "cut.ktx2")


def test_newer_writers_bytes_of_a_block_are_read() -> None:
    """Khronos tools since 2025 leave bytesPlane0 as it was; the ratified specification asks for 0."""
    texture = make_texture("BC1_RGB_SRGB", 16, 8)
    data = zstd_file(texture)
    at = struct.unpack_from("<I", data, 48)[0] + 20
    assert data[at] == 0
    data[at] = 8
    assert decode_ktx2(bytes(data)) == texture


def test_supercompression_is_the_same_in_every_process() -> None:
    code = (
        "import hashlib; from paradize.data import Texture;"
        "from paradize.formats.ktx2.encode import encode_ktx2;"
        "t = Texture('R8_UNORM', 512, 512, (bytes(i * i % 251 for i in range(512 * 512)),));"
        "print(hashlib.sha256(encode_ktx2(t, zstd_level=9)).hexdigest())"
    )
    runs = {subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout for _ in "ab"}
    assert len(runs) == 1
    assert len(runs.pop()) == 65


def test_supercompression_saves_where_there_is_something_to_save() -> None:
    flat = Texture("RGBA8_SRGB", 256, 256, (bytes(256 * 256 * 4),))
    assert len(encode_ktx2(flat, zstd_level=1)) < 1000
    assert len(encode_ktx2(flat)) > 256 * 256 * 4


@pytest.mark.parametrize("zstd_level", [0, -5, 23])
def test_a_level_that_zstandard_does_not_have_is_refused(zstd_level: int) -> None:
    with pytest.raises(FormatError, match="1 to 22"):
        encode_ktx2(ONE, zstd_level=zstd_level)


def test_a_plain_file_loads_no_zstandard() -> None:
    code = (
        "import sys; from paradize.data import Texture; from paradize.formats.ktx2.encode import *;"
        "decode_ktx2(encode_ktx2(Texture('R8_UNORM', 1, 1, (b'1',)))); sys.exit('zstandard' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_the_size_is_read_from_the_first_bytes_of_a_ktx2_alone() -> None:
    data = encode_ktx2(make_texture("BC1_RGB_SRGB", 16, 8))
    assert ktx2_size(data[:SIZE_BYTES]) == ktx2_size(data) == (16, 8, 5)
    for broken in (b"", data[: SIZE_BYTES - 1], b"x" + data[1:]):
        with pytest.raises(FormatError, match="is not a KTX2"):
            ktx2_size(broken)
