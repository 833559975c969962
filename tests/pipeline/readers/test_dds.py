"""DDS pictures: grey, channels of 16 and 32 bits, and what is no picture."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from paradize.errors import SourceError
from paradize.readers.image import read_image
from paradize.readers.notes import NARROWED

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


def newer(path: Path, form: int, texels: bytes, *, more: int = 0, dimension: int = 3, count: int = 1) -> Path:
    """A picture of 4 x 4 texels of a DXGI format."""
    return dds(path, 0, 0, (0, 0, 0, 0), texels, struct.pack("<5I", form, dimension, more, count, 0))


def older(path: Path, code: int, texels: bytes) -> Path:
    """A picture of 4 x 4 texels of a format of Direct3D 9."""
    data = bytearray(dds(path, 0x4, 0, (0, 0, 0, 0), texels).read_bytes())
    struct.pack_into("<I", data, 84, code)
    path.write_bytes(data)
    return path


def test_channels_that_are_read_with_fewer_bits_are_told(tmp_path: Path) -> None:
    masks = (0x3FF, 0xFFC00, 0x3FF00000, 0xC0000000)  # three channels of ten bits
    path = dds(tmp_path / "a.dds", 0x41, 32, masks, (4 * CODES).astype("<u4").tobytes())
    assert read_image(path).notes == (NARROWED,)


def test_grey_of_16_bits_keeps_them(tmp_path: Path) -> None:
    texels = (1000 * CODES).astype("<u2").tobytes()
    grey = dds(tmp_path / "grey.dds", LUMINANCE, 16, (0xFFFF, 0, 0, 0), texels)
    for path in (grey, newer(tmp_path / "newer.dds", 56, texels)):
        image = read_image(path)
        assert np.array_equal(image.values.ravel(), 1000 * CODES)
        assert (image.top, image.source_bits, image.color_space, image.notes) == (65535, 16, "srgb", ())


FLOATS = {"<f2": {1: (111, 54), 2: (112, 34), 4: (113, 10)}, "<f4": {1: (114, 41), 2: (115, 16), 4: (116, 2)}}


@pytest.mark.parametrize("channels", [1, 2, 4])
@pytest.mark.parametrize("kind", FLOATS)
def test_floats_are_linear_numbers_as_they_are(tmp_path: Path, kind: str, channels: int) -> None:
    values = (np.arange(16 * channels) / 8 - 3).astype(kind).reshape(4, 4, channels)
    code, form = FLOATS[kind][channels]
    pair = (
        older(tmp_path / "a.dds", code, values.tobytes()),
        newer(tmp_path / "b.dds", form, values.tobytes()),
    )
    for path in pair:
        image = read_image(path)
        assert np.array_equal(image.values[:, :, :channels], values.astype(np.float32))
        assert image.values.shape[2] == (3 if channels == 2 else channels)  # 2: red, green
        assert (image.top, image.source_bits, image.color_space) == (None, 8 * int(kind[2]), "linear")
        path.write_bytes(path.read_bytes()[:-1])
        with pytest.raises(SourceError, match="damaged or cut: the file ends before its picture does"):
            read_image(path)


def test_texels_of_any_number_of_channels_keep_their_order(tmp_path: Path) -> None:
    codes = (np.arange(64) * 1021).astype("<u2")
    pairs = [(older(tmp_path / "36.dds", 36, codes.tobytes()), 4)]
    pairs += [(newer(tmp_path / f"{form}.dds", form, codes.tobytes()), n) for form, n in ((11, 4), (35, 2))]
    for path, channels in pairs:
        found = read_image(path).values
        assert np.array_equal(found[:, :, :channels], codes[: 16 * channels].reshape(4, 4, channels)), path
    wide = bytearray(newer(tmp_path / "wide.dds", 56, codes.tobytes()).read_bytes())
    struct.pack_into("<2I", wide, 12, 2, 8)  # rows, columns
    (tmp_path / "wide.dds").write_bytes(wide)
    assert np.array_equal(read_image(tmp_path / "wide.dds").values, codes[:16].reshape(2, 8, 1))
    three = np.arange(48, dtype="<f4").reshape(4, 4, 3)
    assert np.array_equal(read_image(newer(tmp_path / "c.dds", 6, three.tobytes())).values, three)


def test_a_float_that_is_no_number_is_refused_with_its_place(tmp_path: Path) -> None:
    values = np.zeros((4, 4), "<f4")
    values[2, 3] = np.nan
    with pytest.raises(SourceError, match=r"texel \(3, 2\): nan in channel 0"):
        read_image(newer(tmp_path / "a.dds", 41, values.tobytes()))


def test_volumes_cube_maps_and_what_is_too_large_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    texels = bytes(64 * 6)
    with pytest.raises(SourceError, match="a volume texture is not one picture; save a slice as PNG"):
        read_image(newer(tmp_path / "a.dds", 41, texels, dimension=4))
    flat = bytearray(newer(tmp_path / "d.dds", 41, texels).read_bytes())
    struct.pack_into("<I", flat, 112, 0x200000)
    (tmp_path / "d.dds").write_bytes(flat)
    with pytest.raises(SourceError, match="a volume texture is not one picture"):
        read_image(tmp_path / "d.dds")
    with pytest.raises(SourceError, match="is not a readable picture"):
        read_image(newer(tmp_path / "e.dds", 41, texels, count=2))
    with pytest.raises(SourceError, match="the six faces of a cube map are not one picture"):
        read_image(newer(tmp_path / "b.dds", 41, texels, more=4))
    monkeypatch.setenv("PARADIZE_MAX_SIDE", "3")
    with pytest.raises(SourceError, match="4 x 4 texels; at most 3 per side"):
        read_image(newer(tmp_path / "c.dds", 41, texels))


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (b"ATC ", "'ATC '"),
        (b"ATCA", "'ATCA'"),
        (b"YUY2", "'YUY2'"),
        (b"\x3f\0\0\0", "63"),
        (b"\n.. ", "539897354"),
    ],
)
def test_a_format_that_is_not_read_is_named_by_its_code(tmp_path: Path, code: bytes, name: str) -> None:
    path = older(tmp_path / "a.dds", int.from_bytes(code, "little"), bytes(64))
    with pytest.raises(SourceError) as caught:
        read_image(path)
    what = f"is not a readable picture: DDS format {name} is not read; save it as PNG, TIFF or OpenEXR"
    assert str(caught.value) == f"{path}: {what}"


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


@pytest.mark.parametrize("mask", [0xFF000000, 0x1FE])
def test_channels_outside_their_texel_are_refused(tmp_path: Path, mask: int) -> None:
    """As Pillow writes grey: the decoder returns black."""
    with pytest.raises(SourceError, match=f"bits {mask:#x} of a texel of 8 bits; save it as PNG"):
        read_image(dds(tmp_path / "a.dds", LUMINANCE, 8, (mask,) * 3 + (0,), CODES.astype("u1").tobytes()))


def test_a_code_that_is_not_declared_and_missing_flags_do_not_count(tmp_path: Path) -> None:
    """As GLI writes pictures without blocks, and some compressors all of theirs."""
    texels = bytes(range(64))
    whole = dds(tmp_path / "a.dds", 0x41, 32, (0xFF, 0xFF00, 0xFF0000, 0xFF000000), texels).read_bytes()
    wanted = np.frombuffer(texels, np.uint8).reshape(4, 4, 4)
    for at, part in ((84, b"DX10"), (8, struct.pack("<I", 6)), (108, bytes(4))):
        (tmp_path / "a.dds").write_bytes(whole[:at] + part + whole[at + 4 :])
        assert np.array_equal(read_image(tmp_path / "a.dds").values, wanted), at
    cube = whole[:84] + b"DX10" + whole[88:112] + struct.pack("<I", 0x200) + whole[116:]
    (tmp_path / "a.dds").write_bytes(cube)
    with pytest.raises(SourceError, match="six faces of a cube map"):
        read_image(tmp_path / "a.dds")


def test_a_header_without_flags_changes_no_value(tmp_path: Path) -> None:
    """Texels that Pillow would read otherwise than below a sound header are refused."""
    wide = dds(tmp_path / "a.dds", 0x41, 32, (0x3FF, 0xFFC00, 0x3FF00000, 0xC0000000), bytes(range(64)))
    wide.write_bytes(wide.read_bytes()[:108] + bytes(4) + wide.read_bytes()[112:])
    assert read_image(wide).notes == (NARROWED,)
    block = bytes(range(16))
    plain = dds(tmp_path / "a.dds", 0x4, 0, (0, 0, 0, 0), b"").read_bytes()[:84] + b"DX10"
    for form, modes in ((98, 0), (98, 2), (98, 3), (95, 0), (84, 0)):
        (tmp_path / "a.dds").write_bytes(plain + bytes(40) + struct.pack("<5I", form, 3, 0, 1, modes) + block)
        if (form, modes) == (98, 0):
            assert read_image(tmp_path / "a.dds").values.shape == (4, 4, 4)
            continue
        with pytest.raises(SourceError, match="Invalid DDS header"):
            read_image(tmp_path / "a.dds")


@pytest.mark.parametrize(("form", "size"), [(70, 8), (73, 16), (76, 16), (79, 8), (82, 16), (97, 16)])
def test_blocks_without_a_type_are_read_as_shares(tmp_path: Path, form: int, size: int) -> None:
    """As those of the next code, which is the same format with a type, but for how thirds are rounded."""
    block = bytes([0x40, 200, 10, 1, 2, 3, 4, 5, 0, 248, 31, 0, 0x1B, 0x1B, 0xE4, 0xE4])[:size]
    shares, typed = (read_image(newer(tmp_path / "a.dds", at, block)).values for at in (form, form + 1))
    assert shares.shape == typed.shape and len(np.unique(typed)) > 2
    assert np.allclose(shares, typed, rtol=0, atol=1)


def test_what_the_newer_header_says_of_alpha_is_done(tmp_path: Path) -> None:
    texel = bytes([50, 100, 25, 100])
    kept, opaque = [50, 100, 25, 100], [50, 100, 25]
    for mode, wanted in ((0, kept), (1, kept), (3, opaque), (0xFB, opaque)):  # of the lowest three bits
        header = struct.pack("<5I", 28, 3, 0, 1, mode)  # R8G8B8A8_UNORM
        picture = read_image(dds(tmp_path / f"{mode}.dds", 0, 0, (0, 0, 0, 0), texel * 16, header))
        assert picture.values[0, 0].tolist() == wanted, mode
    header = struct.pack("<5I", 28, 3, 0, 1, 2)
    pixels = read_image(dds(tmp_path / "2.dds", 0, 0, (0, 0, 0, 0), texel * 16, header)).pixels
    assert pixels[0, 0] == pytest.approx([0.5, 1.0, 0.25, 100 / 255], abs=1e-6)
