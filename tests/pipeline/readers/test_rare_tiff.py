"""TIFFs that OpenImageIO reads wrong or not at all, against what was written."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
import zstandard

from paradize.errors import SourceError
from paradize.readers.heightmap import read_heightmap
from paradize.readers.image import read_image
from tests.pipeline.raw_files import tiff

SIDE = 16  # of a tile


def packed(tile: np.ndarray, order: str, predictor: int) -> bytes:
    """A tile of 64-bit floats as libtiff writes it, before it is compressed."""
    if predictor == 2:
        bits = tile.astype("<f8").view("<u8")
        return np.diff(bits, axis=1, prepend=np.uint64(0)).astype(order + "u8").tobytes()
    if predictor == 3:
        planes = tile.astype(">f8").view(np.uint8).reshape(len(tile), -1, 8).swapaxes(1, 2)
        rows = planes.reshape(len(tile), -1)
        return np.diff(rows, axis=1, prepend=np.uint8(0)).tobytes()
    return tile.astype(order + "f8").tobytes()


def tiled(
    path: Path,
    values: np.ndarray,
    *,
    order: str = "<",
    predictor: int = 1,
    deflate: bool = True,
    big: bool = False,
) -> Path:
    rows, columns = (-(-n // SIDE) * SIDE for n in values.shape)
    whole = np.pad(values, ((0, rows - values.shape[0]), (0, columns - values.shape[1])))
    parts = []
    for y in range(0, rows, SIDE):
        for x in range(0, columns, SIDE):
            data = packed(whole[y : y + SIDE, x : x + SIDE], order, predictor)
            parts.append(zlib.compress(data) if deflate else data)
    more = {322: [SIDE], 323: [SIDE], 317: [predictor], 259: [8 if deflate else 1]}
    return tiff(path, values, order=order, big=big, parts=parts, more=more)


@pytest.mark.parametrize("predictor", [1, 2, 3])
@pytest.mark.parametrize(("order", "big"), [("<", False), (">", False), ("<", True)])
def test_tiles_of_doubles_hold_the_heights_that_were_written(
    tmp_path: Path, predictor: int, order: str, big: bool
) -> None:
    """As GDAL writes elevations: tiles at the rim extend beyond the picture."""
    values = 2500.0 * np.random.default_rng(3).normal(size=(35, 50))
    file = tiled(tmp_path / "a.tif", values, order=order, predictor=predictor, big=big)
    picture = read_image(file)
    assert picture.color_space == "linear" and picture.top is None
    assert np.array_equal(picture.values[:, :, 0], values.astype(np.float32))
    field, _ = read_heightmap(
        tiled(tmp_path / "b.tif", values, deflate=False), size_x_m=9.0, size_z_m=9.0, height_m=None
    )
    assert np.array_equal(field.heights_m, values.astype(np.float32))


def test_tiles_of_doubles_that_are_not_whole_are_refused(tmp_path: Path) -> None:
    file = tiled(tmp_path / "a.tif", np.ones((20, 20)))
    data = file.read_bytes()
    at = data.index(b"\x78\x9c") + 8  # inside the first tile
    file.write_bytes(data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :])
    with pytest.raises(SourceError, match="damaged or cut: tile 0 does not unpack to 2048 bytes"):
        read_image(file)
    short = tiff(tmp_path / "b.tif", np.ones((20, 20)), parts=[bytes(8)] * 4, more={322: [SIDE], 323: [SIDE]})
    with pytest.raises(SourceError, match="tile 0 does not unpack to 2048 bytes"):
        read_image(short)
    more = {322: [SIDE], 323: [SIDE], 259: [5]}
    lzw = tiff(tmp_path / "c.tif", np.ones((20, 20)), parts=[bytes(8)] * 4, more=more)
    with pytest.raises(
        SourceError,
        match=r"compression 5, predictor 1\) are not read; save it as 32-bit float",
    ):
        read_image(lzw)
    bomb = tiled(tmp_path / "d.tif", np.ones((20, 20)))
    large = zlib.compress(bytes(1 << 22))
    tiff(bomb, np.ones((20, 20)), parts=[large] * 4, more={322: [SIDE], 323: [SIDE], 259: [8]})
    with pytest.raises(SourceError, match="tile 0 does not unpack to 2048 bytes"):
        read_image(bomb)


def test_a_palette_with_alpha_gives_its_colours(tmp_path: Path) -> None:
    """As Microsoft Office writes it: an index and alpha for each texel."""
    colors = np.zeros((3, 256), int)
    colors[:, :3] = [[65535, 0, 0], [0, 65535, 0], [0, 0, 65535]]
    texels = bytes([0, 255, 1, 0, 2, 9, 1, 200])
    more = {258: [8, 8], 262: [3], 277: [2], 320: colors.ravel().tolist(), 338: [2], 339: [1, 1]}
    plane = np.zeros((1, 4), np.uint8)
    picture = read_image(tiff(tmp_path / "a.tif", plane, parts=[texels], more=more))
    assert picture.color_space == "srgb" and picture.top == 255
    red, green, blue = np.eye(3, dtype=int) * 255
    assert picture.values[0].tolist() == [[*red, 255], [*green, 0], [*blue, 9], [*green, 200]]

    with pytest.raises(SourceError, match="its strips hold less than 8 bytes"):
        read_image(tiff(tmp_path / "b.tif", plane, parts=[texels[:5]], more=more))
    with pytest.raises(SourceError, match="12 numbers of a palette of 768"):
        read_image(tiff(tmp_path / "c.tif", plane, parts=[texels], more={**more, 320: [0] * 12}))
    with pytest.raises(SourceError, match=r"a palette with another channel .* is not read"):
        read_image(tiff(tmp_path / "d.tif", plane, parts=[texels], more={**more, 338: [1]}))


@pytest.mark.parametrize("codec", ["zstd", "lzma"])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_newer_compressions_give_what_was_written(tmp_path: Path, codec: str, kind: type) -> None:
    values = (1000.0 * np.random.default_rng(5).uniform(0.0, 60.0, (9, 13))).astype(kind)
    PIL.Image.fromarray(values).save(tmp_path / "a.tif", compression=codec)
    picture = read_image(tmp_path / "a.tif", color_space="data")
    assert picture.values.dtype == kind and np.array_equal(picture.values[:, :, 0], values)
    assert picture.notes == ()


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("kind", [np.uint16, np.int16, np.float32])
def test_either_order_of_bytes_gives_the_same_numbers(tmp_path: Path, order: str, kind: type) -> None:
    values = (np.arange(12).reshape(3, 4) * 1000 - (0 if kind == np.uint16 else 5000)).astype(kind)
    strip = zstandard.compress(values.astype(np.dtype(kind).newbyteorder(order)).tobytes())
    file = tiff(tmp_path / "a.tif", values, order=order, parts=[strip], more={259: [50000]})
    picture = read_image(file, color_space="data")
    assert np.array_equal(picture.values[:, :, 0], values)
    assert picture.top == (65535 if kind == np.uint16 else None)


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ({262: [0]}, "photometric 0"),
        ({258: [12]}, "1 channels of 12 bits"),
        ({339: [2]}, "1 channels of 8 bits"),
        ({258: [8] * 4, 262: [2], 277: [4], 338: [0], 339: [1] * 4}, "4 channels of 8 bits"),
        ({274: [6]}, r"to be turned \(orientation 6\)"),
    ],
)
def test_kinds_that_would_come_out_wrong_are_refused_by_name(
    tmp_path: Path, more: dict[int, list[int]], reason: str
) -> None:
    strip = zstandard.compress(bytes(4 * 4 * 4))
    file = tiff(tmp_path / "a.tif", np.zeros((4, 4), np.uint8), parts=[strip], more={259: [50000], **more})
    with pytest.raises(SourceError, match=rf"{reason}.*save it"):
        read_image(file)


def test_tags_that_nobody_needs_may_be_broken(tmp_path: Path) -> None:
    """Where the reader gave up on them, OpenImageIO gave memory that nobody wrote."""
    file = tiled(tmp_path / "a.tif", np.full((20, 20), 7.0))
    data = bytearray(file.read_bytes())
    at = data.index(struct.pack("<HHI", 277, 4, 1))  # samples: becomes a text far beyond the end
    struct.pack_into("<HHII", data, at, 305, 2, 99, 1 << 30)
    file.write_bytes(data)
    assert (read_image(file).values == 7.0).all()


def test_copies_in_a_file_of_a_newer_compression_are_no_pictures(tmp_path: Path) -> None:
    pages = [PIL.Image.new("L", (4, 4), 9) for _ in range(3)]
    for page, role in zip(pages[1:], (1, 4), strict=True):
        page.encoderinfo = {"tiffinfo": {254: role}}
    pages[0].save(tmp_path / "a.tif", save_all=True, append_images=pages[1:], compression="zstd")
    (note,) = read_image(tmp_path / "a.tif").notes
    assert note.startswith("has a mask, which is not read")


def ycbcr(path: Path, packing: int, strip: bytes, rows: int = 8) -> Path:
    more = {258: [8, 8, 8], 259: [packing], 262: [6], 277: [3], 339: [1, 1, 1], 530: [1, 1]}
    return tiff(path, np.zeros((rows, 8), np.uint8), parts=[strip], more=more)


def test_ycbcr_is_read_and_its_damage_is_told(tmp_path: Path) -> None:
    """OpenImageIO gives one green for whatever it cannot unpack."""
    texels = np.tile(np.array([120, 128, 128], np.uint8), (8 * 8, 1))  # grey
    sound = ycbcr(tmp_path / "a.tif", 8, zlib.compress(texels.tobytes()))
    assert np.abs(read_image(sound).values.astype(int) - 120).max() <= 1
    data = zlib.compress(np.random.default_rng(1).integers(0, 256, (8, 8, 3), np.uint8).tobytes())
    bad = ycbcr(tmp_path / "b.tif", 8, data[:-1] + bytes([data[-1] ^ 1]))
    with pytest.raises(SourceError, match="damaged or cut: ZIPDecode"):
        read_image(bad)
    unknown = ycbcr(tmp_path / "c.tif", 34712, bytes(200))  # JPEG 2000
    with pytest.raises(SourceError, match="is compressed by scheme 34712, which is not read; save it as"):
        read_image(unknown)
    empty = ycbcr(tmp_path / "d.tif", 7, bytes(200))  # no JPEG
    with pytest.raises(SourceError, match="is not a readable TIFF"):
        read_image(empty)


def test_sixteen_bits_that_a_decoder_of_eight_would_lose_are_refused(tmp_path: Path) -> None:
    """Lossless JPEG, as scanners of X-rays write it: OpenImageIO gives zeros of 8 bits."""
    file = tiff(tmp_path / "a.tif", np.zeros((8, 8), np.uint16), parts=[bytes(99)], more={259: [7]})
    with pytest.raises(SourceError, match="16 bits of a channel, compressed as JPEG, are not read"):
        read_image(file)


def test_where_zero_is_white_numbers_are_as_they_are(tmp_path: Path) -> None:
    for kind in (np.int16, np.float32):
        values = np.array([[-9999, 0, 300]], kind)
        found = read_image(tiff(tmp_path / "a.tif", values, more={262: [0]}), color_space="data").values
        assert np.array_equal(found[:, :, 0], values)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.uint32])
def test_where_zero_is_white_greys_are_turned_over_and_alpha_is_not(tmp_path: Path, kind: type) -> None:
    top = np.iinfo(kind).max
    values = np.array([[0, top // 3, top]], kind)
    grey = read_image(tiff(tmp_path / "a.tif", values, more={262: [0]})).pixels[:, :, 0]
    assert grey == pytest.approx(1.0 - values / top, abs=1e-6)
    more = {258: [8 * values.itemsize] * 2, 262: [0], 277: [2], 338: [2], 339: [1, 1]}
    both = np.stack([values, values], axis=2).tobytes()
    alpha = read_image(tiff(tmp_path / "b.tif", values, parts=[both], more=more)).pixels
    assert alpha[:, :, 0] == pytest.approx(1.0 - values / top, abs=1e-6)
    assert alpha[:, :, 1] == pytest.approx(values / top, abs=1e-6)


def test_a_fourth_channel_of_no_meaning_is_taken_for_alpha_and_told(tmp_path: Path) -> None:
    more = {258: [8] * 4, 262: [2], 277: [4], 338: [0], 339: [1] * 4}
    file = tiff(tmp_path / "a.tif", np.zeros((1, 2), np.uint8), parts=[bytes(range(8))], more=more)
    picture = read_image(file)
    assert picture.values.shape == (1, 2, 4)
    assert picture.notes == ("its fourth channel is taken for alpha, as game engines take it",)


def test_of_five_bands_that_are_no_colours_the_first_is_read(tmp_path: Path) -> None:
    values = np.arange(30, dtype=np.float32).reshape(2, 3, 5)
    more = {258: [32] * 5, 262: [1], 277: [5], 338: [0] * 4, 339: [3] * 5}
    file = tiff(tmp_path / "a.tif", np.zeros((2, 3), np.float32), parts=[values.tobytes()], more=more)
    picture = read_image(file, color_space="data")
    assert np.array_equal(picture.values[:, :, 0], values[:, :, 0]) and picture.values.shape[2] == 1
    assert picture.notes == ("has several channels that are no colours; the first is read",)
