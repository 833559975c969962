"""Promises of the KTX2 writer and reader."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.data import Texture
from paradize.errors import FormatError
from paradize.formats.ktx2 import (
    FORMATS,
    decode_ktx2,
    encode_ktx2,
    full_level_count,
    level_bytes,
)


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


@pytest.mark.parametrize("name", sorted(FORMATS))
@pytest.mark.parametrize("faces", [1, 6])
def test_every_format_comes_back_as_it_went(name: str, faces: int) -> None:
    texture = make_texture(name, 20, 20, faces)
    assert decode_ktx2(encode_ktx2(texture)) == texture


@settings(deadline=None, max_examples=60)
@given(
    st.sampled_from(sorted(FORMATS)), st.integers(1, 40), st.integers(1, 40), st.integers(1, 6), st.booleans()
)
def test_any_size_and_any_chain_comes_back(
    name: str, width: int, height: int, count: int, cube: bool
) -> None:
    height = width if cube else height
    texture = make_texture(name, width, height, 6 if cube else 1, min(count, full_level_count(width, height)))
    data = encode_ktx2(texture)
    assert decode_ktx2(data) == texture
    alignment = {1: 4, 2: 4, 4: 4, 8: 8, 16: 16}[FORMATS[name].block_bytes]
    for level in range(len(texture.levels)):
        assert struct.unpack_from("<Q", data, 80 + 24 * level)[0] % alignment == 0


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
