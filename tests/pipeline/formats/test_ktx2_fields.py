"""Every number that a KTX2 file states, set to the ends of what it can say: refused by name, or harmless."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import pytest

from paradize.data import Texture
from paradize.errors import FormatError
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.layout import level_bytes
from paradize.formats.ktx2.reader import decode_ktx2

COUNT = 4
SIZES = [level_bytes("RG8_SNORM", 8, 8, level, 1) for level in range(COUNT)]
TEXTURE = Texture(
    "RG8_SNORM", 8, 8, tuple(bytes((7 * i + level) % 251 for i in range(n)) for level, n in enumerate(SIZES))
)
HEADER = {12 + 4 * i: "I" for i in range(9)} | {48 + 4 * i: "I" for i in range(4)} | {64: "Q", 72: "Q"}
INDEX = {80 + 8 * i: "Q" for i in range(3 * COUNT)}
FRAME_BITS = 8 * 24  # of each frame: its header, the block's header, the first codes


def ends(kind: str, there: int, length: int) -> Iterator[int]:
    """Where arithmetic breaks: around 0, the true one, the file's end, powers of two."""
    top = 1 << (32 if kind == "I" else 64)
    near = (0, there, length, top // 2, top, 1 << 16, 1 << 31, 1 << 32)
    yield from sorted({value + d for value in near for d in (-2, -1, 0, 1, 2) if 0 <= value + d < top})


def survived(data: bytes) -> bool:
    """Whether it was read; then it is a texture of the size that its header states. Else a clear error."""
    try:
        read = decode_ktx2(data, "wrong.ktx2")
    except FormatError as error:
        assert str(error).startswith("wrong.ktx2: ")
        return False
    for level, texels in enumerate(read.levels):
        assert len(texels) == level_bytes(read.format, read.width, read.height, level, read.faces)
    return True


@pytest.mark.parametrize("zstd_level", [None, 3])
def test_every_field_at_its_ends_is_refused(zstd_level: int | None) -> None:
    data = encode_ktx2(TEXTURE, zstd_level=zstd_level)
    tried, read = 0, []
    for at, kind in (HEADER | INDEX).items():
        (there,) = struct.unpack_from(f"<{kind}", data, at)
        for value in ends(kind, there, len(data)):
            if value == there:
                continue
            wrong = bytearray(data)
            struct.pack_into(f"<{kind}", wrong, at, value)
            tried += 1
            if survived(bytes(wrong)):
                read.append((at, value))
    assert tried > 500
    assert read == []


def test_two_fields_that_lie_together_are_survived() -> None:
    """Offset and length of a level, or both sizes, wrong so that their sum or product wraps around."""
    for zstd_level in (None, 3):
        data = encode_ktx2(TEXTURE, zstd_level=zstd_level)
        pairs = [(80 + 24 * i, 88 + 24 * i, "Q") for i in range(COUNT)]
        for first, second, kind in [*pairs, (20, 24, "I"), (48, 52, "I"), (56, 60, "I")]:
            for a in ends(kind, 0, len(data)):
                for b in ends(kind, 0, len(data)):
                    wrong = bytearray(data)
                    struct.pack_into(f"<{kind}", wrong, first, a)
                    struct.pack_into(f"<{kind}", wrong, second, b)
                    assert not survived(bytes(wrong)), (first, a, b)


def test_every_bit_at_the_head_of_a_frame_may_flip() -> None:
    data = encode_ktx2(TEXTURE, zstd_level=3)
    refused = 0
    for level in range(COUNT):
        at, length, _ = struct.unpack_from("<3Q", data, 80 + 24 * level)
        for bit in range(min(FRAME_BITS, 8 * length)):
            wrong = bytearray(data)
            wrong[at + bit // 8] ^= 1 << bit % 8
            refused += not survived(bytes(wrong))
    assert refused > 100
