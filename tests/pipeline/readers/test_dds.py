"""DDS pictures whose texels are grey, or have channels of 16 bits."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from paradize.errors import SourceError
from paradize.readers.image import read_image

CODES = np.arange(16, dtype=np.uint16)
LUMINANCE, ALPHA = 0x20000, 0x1


def dds(path: Path, flags: int, bits: int, masks: tuple[int, ...], texels: bytes, tail: bytes = b"") -> Path:
    """A picture of 4 x 4 texels without a code, or, with `tail`, the header of DX10."""
    head = struct.pack("<7I", 124, 0x100F, 4, 4, bits // 2, 0, 1) + bytes(44)
    code = b"DX10" if tail else bytes(4)
    form = struct.pack("<2I4s5I", 32, 0x4 if tail else flags, code, bits, *masks)
    path.write_bytes(b"DDS " + head + form + struct.pack("<5I", 0x1000, 0, 0, 0, 0) + tail + texels)
    return path


def test_grey_beside_alpha_is_not_red_and_green(tmp_path: Path) -> None:
    texels = (0x8000 + 3 * CODES).astype("<u2").tobytes()
    image = read_image(dds(tmp_path / "a.dds", LUMINANCE | ALPHA, 16, (0xFF, 0, 0, 0xFF00), texels))
    assert image.values.shape == (4, 4, 2)
    assert np.array_equal(image.values[:, :, 0].ravel(), 3 * CODES) and (image.values[:, :, 1] == 0x80).all()
    assert image.notes == ()


def test_channels_that_are_read_with_fewer_bits_are_told(tmp_path: Path) -> None:
    texels = (1000 * CODES).astype("<u2").tobytes()
    grey = dds(tmp_path / "grey.dds", LUMINANCE, 16, (0xFFFF, 0, 0, 0), texels)
    newer = dds(tmp_path / "newer.dds", 0, 0, (0, 0, 0, 0), texels, struct.pack("<5I", 56, 3, 0, 1, 0))
    for path in (grey, newer):
        image = read_image(path)
        assert np.array_equal(image.values.ravel(), (1000 * CODES) >> 8)
        assert "read with 8" in image.notes[0]


@pytest.mark.parametrize(
    ("flags", "bits", "masks", "channels"),
    [
        (0x40, 24, (0xFF0000, 0xFF00, 0xFF, 0xFF000000), 3),
        (LUMINANCE, 8, (0xFF, 0xFF00, 0xFF0000, 0), 1),
        (LUMINANCE, 8, (0xFF, 0, 0, 0xFF000000), 1),
    ],
)
def test_masks_of_channels_that_the_flags_leave_out_do_not_count(
    tmp_path: Path, flags: int, bits: int, masks: tuple[int, ...], channels: int
) -> None:
    texels = np.arange(2 * bits, dtype="u1").tobytes()
    image = read_image(dds(tmp_path / "a.dds", flags, bits, masks, texels))
    assert image.values.shape == (4, 4, channels)
    assert image.values.max() == 2 * bits - 1 and image.notes == ()


def test_the_smallest_picture_is_looked_at_too(tmp_path: Path) -> None:
    """130 bytes: no room for the format of a newer header."""
    path = dds(tmp_path / "a.dds", LUMINANCE | ALPHA, 16, (0xFF, 0, 0, 0xFF00), b"")
    data = bytearray(path.read_bytes())
    struct.pack_into("<2I", data, 12, 1, 1)
    path.write_bytes(bytes(data) + b"\x50\xa0")
    assert read_image(path).values.ravel().tolist() == [0x50, 0xA0]


@pytest.mark.parametrize(("flags", "bits", "masks"), [(LUMINANCE, 8, (0xFF000000,) * 3 + (0,))])
def test_channels_outside_their_texel_are_refused(
    tmp_path: Path, flags: int, bits: int, masks: tuple[int, ...]
) -> None:
    """As Pillow writes grey: the decoder returns black."""
    with pytest.raises(SourceError, match="bits 0xff000000 of a texel of 8 bits; save it as PNG"):
        read_image(dds(tmp_path / "a.dds", flags, bits, masks, CODES.astype("u1").tobytes()))
