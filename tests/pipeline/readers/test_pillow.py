"""Pictures that Pillow reads for us: bitmaps, QOI and AVIF have the texels that their files say."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

from paradize.errors import SourceError
from paradize.readers.image import read_image
from paradize.readers.notes import FOURTH, NARROWED, SEVERAL, UNREAD_LAYERS, turned


def bitmap(
    bits: int, packing: int, rows: bytes, *, masks: tuple[int, ...] = (), colors: bytes = b""
) -> bytes:
    """A bitmap of 2 x 2 texels. With masks the header is that of version 4, which names alpha's too."""
    extra = struct.pack("<4I", *masks) + bytes(52) if masks else b""
    size = 40 + len(extra)
    head = struct.pack("<IiiHHIIiiII", size, 2, 2, 1, bits, packing, len(rows), 0, 0, len(colors) // 4, 0)
    start = 14 + size + len(colors)
    return b"BM" + struct.pack("<IHHI", start + len(rows), 0, 0, start) + head + extra + colors + rows


RED, GREEN, BLUE, WHITE = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)
UPRIGHT = [[BLUE, WHITE], [RED, GREEN]]  # the file begins with the lowest row
WITH_ALPHA = [[(0, 0, 255, 64), (255, 255, 255, 0)], [(255, 0, 0, 255), (0, 255, 0, 128)]]


ONE_BIT = [[(0, 0, 255, 255), (255, 255, 255, 0)], [(255, 0, 0, 0), (0, 255, 0, 255)]]
RED_FIRST = (0xFF, 0xFF00, 0xFF0000, 0xFF000000)
FOUR_COLORS, TWO_GREYS = "0000ff00 00ff0000 ff000000 ffffff00", "00000000 ffffff00"
BITMAPS: dict[str, tuple[int, int, str, tuple[int, ...], str, list[list[tuple[int, ...]]]]] = {
    # bits, packing, rows, masks, colours of the palette, texels
    "unused byte": (32, 0, FOUR_COLORS, (), "", UPRIGHT),
    "red first": (32, 3, "ff0000ff 00ff0080 0000ff40 ffffff00", RED_FIRST, "", WITH_ALPHA),
    "alpha first": (32, 3, "ff0000ff 8000ff00 40ff0000 00ffffff", RED_FIRST[::-1], "", WITH_ALPHA),
    "16 bits": (16, 0, "007ce003 1f00ff7f", (), "", UPRIGHT),
    "run-length coded": (8, 1, "0100 0101 0000 0102 0103 0001", (), FOUR_COLORS, UPRIGHT),
    "two greys": (8, 1, "0100 0101 0000 0101 0100 0001", (), TWO_GREYS, [[(255,), (0,)], [(0,), (255,)]]),
}


@pytest.mark.parametrize("name", BITMAPS)
def test_a_bitmap_has_the_colours_that_its_header_says(tmp_path: Path, name: str) -> None:
    bits, packing, rows, masks, colors, texels = BITMAPS[name]
    path = tmp_path / "a.bmp"
    path.write_bytes(bitmap(bits, packing, bytes.fromhex(rows), masks=masks, colors=bytes.fromhex(colors)))
    assert read_image(path).values.tolist() == [[list(texel) for texel in row] for row in texels]


def test_a_bitmap_under_a_header_of_os_2_is_not_given_the_size_of_the_one_read_before(tmp_path: Path) -> None:
    plain = bitmap(8, 0, bytes([0, 1, 0, 0, 2, 3, 0, 0]), colors=bytes.fromhex(FOUR_COLORS))
    for size in (2, 3):
        wide = plain[:18] + struct.pack("<I", size) + plain[22:]
        (tmp_path / "before.bmp").write_bytes(wide)
        assert read_image(tmp_path / "before.bmp").values.shape == (2, size, 3)
        newer = plain[:10] + struct.pack("<2I", 54 + 24 + 16, 64) + plain[18:54] + bytes(24) + plain[54:]
        (tmp_path / "a.bmp").write_bytes(newer)
        assert read_image(tmp_path / "a.bmp").values.tolist() == [[list(t) for t in row] for row in UPRIGHT]
    (tmp_path / "a.bmp").write_bytes(b"BA" + newer[2:])
    with pytest.raises(SourceError, match="is not a readable BMP picture: Not a BMP file"):
        read_image(tmp_path / "a.bmp")


def test_the_canvas_that_the_first_picture_of_a_webp_leaves_free_is_clear(tmp_path: Path) -> None:
    first, second = (PIL.Image.new("RGBA", (64, 64), (0, 0, 0, 0)) for _ in range(2))
    first.paste((255, 0, 0, 255), (20, 20, 24, 24))
    second.paste((0, 0, 255, 128), (0, 0, 64, 64))
    first.save(tmp_path / "a.webp", save_all=True, append_images=[second], lossless=True)
    image = read_image(tmp_path / "a.webp")
    assert (image.notes, image.values[22, 22].tolist()) == ((SEVERAL,), [255, 0, 0, 255])
    assert image.values[:20].max() == 0 and (image.values[:, :, 3] > 0).sum() == 16


SHUFFLED = "00ff0000 000000ff 0000ff00 00ffffff"  # from the lowest byte: unused, red, blue, green
MASKED: dict[str, tuple[int, int, str, tuple[int, ...], list[list[tuple[int, ...]]]]] = {
    # bits, packing, rows, masks (alpha's is none of the first packing under a header of 40 bytes), texels
    "4 bits": (16, 3, "000ff000 0f00ff0f", (0xF00, 0xF0, 0xF, 0), UPRIGHT),
    "a byte without use": (32, 3, SHUFFLED, (0xFF00, 0xFF << 24, 0xFF0000, 0xFF), UPRIGHT),
    "16 bits of colour in 32": (
        32,
        3,
        "00f80000 e0070000 1f000000 ffff0000",
        (0xF800, 0x7E0, 0x1F, 0),
        UPRIGHT,
    ),
    "one bit of alpha": (16, 6, "007ce083 1f80ff7f", (0x7C00, 0x3E0, 0x1F, 0x8000), ONE_BIT),
    "alpha by its own packing": (32, 6, "ff0000ff 00ff0080 0000ff40 ffffff00", RED_FIRST, WITH_ALPHA),
}


@pytest.mark.parametrize("name", MASKED)
def test_a_channel_of_a_bitmap_has_the_bits_of_its_mask(tmp_path: Path, name: str) -> None:
    bits, packing, rows, masks, texels = MASKED[name]
    path, whole = tmp_path / "a.bmp", bitmap(bits, packing, bytes.fromhex(rows), masks=masks)
    whole = whole[:14] + struct.pack("<I", 40) + whole[18:]
    path.write_bytes(whole)
    assert read_image(path).values.tolist() == [[list(texel) for texel in row] for row in texels]
    path.write_bytes(whole[:22] + struct.pack("<i", -2) + whole[26:])
    assert read_image(path).values.tolist() == [[list(texel) for texel in row] for row in texels[::-1]]
    path.write_bytes(whole[:-1])
    with pytest.raises(SourceError, match="the file ends before its picture does"):
        read_image(path)


def test_a_mask_of_more_than_a_byte_keeps_its_steps_and_one_with_a_gap_is_refused(tmp_path: Path) -> None:
    path, masks = tmp_path / "a.bmp", (0x7FF << 21, 0x3FF << 11, 0x7FF, 0)
    rows = struct.pack("<4I", 1 << 21, 1 << 11, 1, 0xFFFFFFFF)
    path.write_bytes(bitmap(32, 3, rows, masks=masks))
    image = read_image(path)
    assert (image.top, image.source_bits) == (65535, 16)
    assert image.values.tolist() == [[[0, 0, 32], [65535] * 3], [[32, 0, 0], [0, 64, 0]]]
    path.write_bytes(bitmap(32, 3, rows, masks=(0x5, 0xFF00, 0xFF0000, 0)))
    with pytest.raises(SourceError, match=r"is 0x5; its bits must lie side by side, in 32 bits; save"):
        read_image(path)


def test_rows_of_a_bitmap_with_masks_are_padded_values_rounded_and_sizes_held_to_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.bmp"
    whole = bitmap(16, 3, struct.pack("<8H", 16, 1, 0, 99, 0, 0, 31, 99), masks=(0x1F, 0x1F, 0x1F, 0))
    path.write_bytes(whole[:18] + struct.pack("<i", 3) + whole[22:])
    assert read_image(path).values[:, :, 0].tolist() == [[0, 0, 255], [132, 8, 0]]  # 131.6, 8.2
    monkeypatch.setenv("PARADIZE_MAX_SIDE", "2")
    with pytest.raises(SourceError, match="3 x 2 texels; at most 2 per side"):
        read_image(path)


def test_texels_of_a_bitmap_under_the_shortest_header_are_no_masks(tmp_path: Path) -> None:
    """That header has neither packing nor masks: the bytes where they would stand are colours."""
    texels = (bytes(2) + struct.pack("<HI", 16, 3)).ljust(80, b"\2")
    head = struct.pack("<2sIHHI", b"BM", 106, 0, 0, 26) + struct.pack("<IHHHH", 12, 4, 6, 1, 24)
    path = tmp_path / "a.bmp"
    path.write_bytes(head + texels)
    assert read_image(path).values[5, :2].tolist() == [[16, 0, 0], [0, 3, 0]]


# channels, layers (negative: the fourth channel is their transparency), texels one channel after another
MERGED: dict[str, tuple[int, int, str, list[list[int]], tuple[str, ...]]] = {
    "without alpha": (3, 1, "0a0b 0c0d 0e0f", [[10, 12, 14], [11, 13, 15]], ()),
    "a fourth channel": (4, 1, "0a0b 0c0d 0e0f 1011", [[10, 12, 14, 16], [11, 13, 15, 17]], (FOURTH,)),
    "an empty one": (4, 1, "0a0b 0c0d 0e0f 0000", [[10, 12, 14], [11, 13, 15]], ()),
    "transparency": (4, -1, "ffff ff7f ffbf 0080", [[0, 0, 0, 0], [255, 0, 128, 128]], ()),
}


@pytest.mark.parametrize("name", MERGED)
def test_a_photoshop_file_whose_layers_are_not_read_is_the_picture_of_them_all(
    tmp_path: Path, name: str
) -> None:
    """The row of the layer's channel promises more bytes than there are."""
    channels, count, texels, expected, notes = MERGED[name]
    layer = (
        struct.pack(">h4iHhI", count, 0, 0, 1, 2, 1, 0, 4) + b"8BIMnorm" + bytes([255, 0, 0, 0]) + bytes(4)
    )
    layers = layer + struct.pack(">2H", 1, 0xFFFF)
    head = struct.pack(">4sH6xHIIHH", b"8BPS", 1, channels, 1, 2, 8, 3) + struct.pack(
        ">2I4s8x", 0, 12, b"8BIM"
    )
    whole = (
        head + struct.pack(">2I", len(layers) + 4, len(layers)) + layers + bytes(2) + bytes.fromhex(texels)
    )
    path = tmp_path / "a.psd"
    path.write_bytes(whole)
    image = read_image(path)
    assert (image.values.tolist(), image.notes) == ([expected], (UNREAD_LAYERS, *notes))
    path.write_bytes(whole[:-1])
    with pytest.raises(SourceError, match="failed load_layers"):
        read_image(path)


def test_a_bitmap_beyond_the_limits_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.bmp"
    path.write_bytes(bitmap(24, 0, bytes(16)))
    assert read_image(path).values.shape == (2, 2, 3)
    monkeypatch.setenv("PARADIZE_MAX_SIDE", "1")
    with pytest.raises(SourceError, match="2 x 2 texels; at most 1 per side"):
        read_image(path)


SIZE = (5, 7)  # rows and columns of the pictures below


def saved(path: Path, codes: np.ndarray, **how: object) -> Path:
    """A picture as Pillow writes it."""
    PIL.Image.fromarray(codes).save(path, **how)
    return path


@pytest.mark.parametrize("channels", [3, 4])
def test_a_qoi_has_the_texels_that_were_saved(tmp_path: Path, channels: int) -> None:
    codes = (np.arange(np.prod(SIZE) * channels) * 7919 % 256).reshape(*SIZE, channels).astype(np.uint8)
    path = saved(tmp_path / "a.qoi", codes)
    image = read_image(path)
    assert np.array_equal(image.values, codes)
    assert (image.color_space, image.source_bits, image.top) == ("srgb", 8, 255)
    assert read_image(path, color_space="data").color_space == "data"


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_an_avif_is_near_the_texels_that_were_saved(tmp_path: Path, channels: int) -> None:
    ramp = np.linspace(0, 255, np.prod(SIZE) * 9).reshape(3 * SIZE[0], 3 * SIZE[1]).astype(np.uint8)
    codes = np.stack([ramp, ramp[::-1], ramp[:, ::-1], 255 - ramp], axis=2)[:, :, :channels]
    given = codes[:, :, 0] if channels == 1 else codes
    path = saved(tmp_path / "a.avif", given, quality=100, subsampling="4:4:4")
    image = read_image(path)
    grey = np.repeat(codes, 3, axis=2) if channels == 1 else codes  # AVIF has no grey alone
    assert image.values.shape == grey.shape
    assert np.abs(image.values.astype(int) - grey).max() <= 4
    assert (image.color_space, image.source_bits, image.notes) == ("srgb", 8, ())


def test_an_avif_of_several_pictures_is_told(tmp_path: Path) -> None:
    frames = [PIL.Image.new("RGB", (8, 8), color) for color in ("red", "blue")]
    path = tmp_path / "a.avif"
    frames[0].save(path, save_all=True, append_images=frames[1:], quality=100)
    image = read_image(path)
    assert image.notes == (SEVERAL,)
    assert np.abs(image.values.reshape(-1, 3).astype(int) - (255, 0, 0)).max() <= 4


def test_an_avif_of_more_bits_or_of_high_dynamic_range_is_told(tmp_path: Path) -> None:
    path = saved(tmp_path / "a.avif", np.full((8, 8, 3), 90, np.uint8))
    data = bytearray(path.read_bytes())
    deep, pixi, curve = (data.find(box) for box in (b"av1C", b"pixi", b"colrnclx"))
    data[deep + 6] |= 0x40  # 10 bits, which the box `pixi` says too
    data[pixi + 9 : pixi + 12] = b"\x0a\x0a\x0a"
    path.write_bytes(data)
    assert read_image(path).notes == (NARROWED,)
    data[curve + 11] = 8
    path.write_bytes(data)
    assert read_image(path).color_space == "linear"
    for code, name in ((16, "PQ"), (18, "HLG")):
        data[curve + 11] = code
        path.write_bytes(data)
        message = rf"of high dynamic range \({name}\), not sRGB; save it as OpenEXR"
        with pytest.raises(SourceError, match=message):
            read_image(path)


def test_an_avif_that_says_to_be_turned_is_told(tmp_path: Path) -> None:
    exif = PIL.Image.Exif()
    exif[0x0112] = 6
    image = read_image(saved(tmp_path / "a.avif", np.zeros((8, 16, 3), np.uint8), exif=exif))
    assert image.notes == (turned(6),) and image.values.shape == (8, 16, 3)


@pytest.mark.parametrize("name", ["a.qoi", "a.avif"])
def test_any_cut_is_refused_in_one_message(tmp_path: Path, name: str) -> None:
    codes = np.random.default_rng(5).integers(0, 256, (16, 16, 3), np.uint8)
    data = saved(tmp_path / name, codes).read_bytes()
    for length in (len(data) - 1, len(data) - 9, len(data) // 2, 33, 20, 12, 4):
        (tmp_path / name).write_bytes(data[:length])
        with pytest.raises(SourceError, match=f"{name}: (is not a readable|damaged or cut)") as refusal:
            read_image(tmp_path / name)
        assert "\n" not in str(refusal.value) and "object at 0x" not in str(refusal.value), length


@pytest.mark.parametrize("name", ["a.qoi", "a.avif"])
def test_spoilt_bytes_give_a_picture_or_one_message(tmp_path: Path, name: str) -> None:
    rng = np.random.default_rng(5)
    data = saved(tmp_path / name, rng.integers(0, 256, (16, 16, 3), np.uint8)).read_bytes()
    for _ in range(60):
        spoilt = np.frombuffer(data, np.uint8).copy()
        spoilt[rng.integers(4, len(data), 3)] = rng.integers(0, 256, 3)
        (tmp_path / name).write_bytes(spoilt.tobytes())
        try:
            assert read_image(tmp_path / name).values.dtype == np.uint8
        except SourceError as refusal:
            assert "\n" not in str(refusal) and "object at 0x" not in str(refusal)


@pytest.mark.parametrize("name", ["a.qoi", "a.avif"])
def test_one_beyond_the_limits_is_refused(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = saved(tmp_path / name, np.zeros((8, 16, 3), np.uint8))
    monkeypatch.setenv("PARADIZE_MAX_SIDE", "15")
    with pytest.raises(SourceError, match="16 x 8 texels; at most 15 per side"):
        read_image(path)
