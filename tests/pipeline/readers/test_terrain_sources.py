"""Raw SRTM tiles and pixels without a height: read, filled from their surroundings, and told."""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.errors import SourceError
from paradize.readers.damage import check_damage
from paradize.readers.geotiff import read_geotiff_tags
from paradize.readers.heightmap import read_heightmap, with_heights
from paradize.readers.image import read_image
from paradize.readers.nodata import fill_nodata
from tests.pipeline.raw_files import exr, png, tiff

BT709 = (0.2126, 0.7152, 0.0722)


def slope(side: int) -> npt.NDArray[np.float64]:
    return np.asarray(np.add.outer(3.0 * np.arange(side), 2.0 * np.arange(side)), np.float64)


@pytest.mark.parametrize("lift", [0, 1])
def test_ground_of_one_height_is_told(tmp_path: Path, lift: int) -> None:
    codes = np.full((8, 8, 1), 32768, np.uint16)
    codes[5, 2] += lift
    path = png(tmp_path / "flat.png", codes, 0, 16)
    field, warnings = read_heightmap(path, size_x_m=1, size_z_m=1, height_m=65.535)
    told = f"{path}: every height is 32.768 m, so the ground is flat; give the picture that holds the heights"
    assert warnings == ([] if lift else [told])
    assert np.ptp(field.heights_m) == pytest.approx(0.001 * lift, abs=1e-5)


def test_an_srtm_tile_is_metres_with_its_voids_filled(tmp_path: Path) -> None:
    """Also of land that lies below the sea."""
    truth = slope(33) - 40
    heights = truth.astype(">i2")
    heights[10:14, 20:25] = -32768
    path = tmp_path / "N00E000.hgt"
    path.write_bytes(heights.tobytes())
    field, warnings = read_heightmap(path, size_x_m=1, size_z_m=1, height_m=None)
    assert np.abs(field.heights_m - truth).max() < 1.5
    known = heights != -32768
    assert np.array_equal(field.heights_m[known], truth[known])
    assert len(warnings) == 1 and "20 pixels" in warnings[0] and "(20, 10)" in warnings[0]


def test_a_northern_srtm_tile_has_half_the_columns(tmp_path: Path) -> None:
    heights = np.add.outer(np.arange(3601), 2 * np.arange(1801)).astype(">i2")
    (tmp_path / "N61E010.hgt").write_bytes(heights.tobytes())
    field, warnings = read_heightmap(tmp_path / "N61E010.hgt", size_x_m=1, size_z_m=1, height_m=None)
    assert np.array_equal(field.heights_m, heights.astype(np.float32)) and not warnings


def test_integers_without_a_height_of_white_are_refused_before_anything_is_filled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    png(tmp_path / "a.png", np.full((4, 4, 1), 7, np.uint16), 0, 16)

    def filled(*_: object) -> None:
        pytest.fail("holes were filled")

    monkeypatch.setattr("paradize.readers.heightmap._fill", filled)
    with pytest.raises(SourceError, match="not metres; say how high white stands"):
        read_heightmap(tmp_path / "a.png", size_x_m=1, size_z_m=1, height_m=None)


def test_of_two_bands_of_numbers_the_first_is_the_heights(tmp_path: Path) -> None:
    heights = np.stack([slope(9), slope(9) + 7.0], axis=2).astype(np.float32)
    out = oiio.ImageOutput.create(str(tmp_path / "h.tif"))
    assert out.open(str(tmp_path / "h.tif"), oiio.ImageSpec(9, 9, 2, "float")) and out.write_image(heights)
    out.close()
    field, warnings = read_heightmap(tmp_path / "h.tif", size_x_m=1, size_z_m=1, height_m=None)
    assert np.array_equal(field.heights_m, slope(9))
    assert warnings == [f"{tmp_path / 'h.tif'}: has several channels that are no colours; the first is read"]
    image, again = with_heights(read_image(tmp_path / "h.tif"), tmp_path / "h.tif", "auto")
    assert np.array_equal(image.values[:, :, 0], slope(9)) and again == warnings
    assert read_image(tmp_path / "h.tif").values.shape == (9, 9, 3), "a normal map may have two"


@pytest.mark.parametrize("step", [-30.0, 30.0])
def test_a_geotiff_whose_first_row_is_the_south_is_told(tmp_path: Path, step: float) -> None:
    transform = [30.0, 0, 0, 5e5, 0, step, 0, 6e6, 0, 0, 0, 0, 0, 0, 0, 1]
    tiff(tmp_path / "a.tif", slope(9).astype(np.float32), transform=transform)
    _, warnings = read_heightmap(tmp_path / "a.tif", size_x_m=1, size_z_m=1, height_m=None)
    assert [text for text in warnings if "its first row is the south" in text] == warnings
    assert len(warnings) == (step > 0.0)


def test_a_heightmap_that_is_too_large_is_not_called_too_small(tmp_path: Path) -> None:
    png(tmp_path / "a.png", np.zeros((2, 16386, 1), np.uint8), 0, 8)
    with pytest.raises(SourceError, match=r"is 16386 x 2 pixels; .* make it smaller, or cut it into several"):
        read_heightmap(tmp_path / "a.png", size_x_m=1, size_z_m=1, height_m=1.0)


@pytest.mark.parametrize("size", [0, 7, 10, 2 * 33 * 34])
def test_a_cut_srtm_tile_is_refused(tmp_path: Path, size: int) -> None:
    path = tmp_path / "cut.hgt"
    path.write_bytes(bytes(size))
    with pytest.raises(SourceError, match="square"):
        read_heightmap(path, size_x_m=1, size_z_m=1, height_m=1.0)


def test_nan_in_floats_is_filled_and_told(tmp_path: Path) -> None:
    heights = slope(20).astype(np.float32)
    heights[7, 3] = np.nan
    spec = oiio.ImageSpec(20, 20, 1, "float")
    out = oiio.ImageOutput.create(str(tmp_path / "h.tif"))
    assert out and out.open(str(tmp_path / "h.tif"), spec) and out.write_image(heights[:, :, None])
    out.close()
    field, warnings = read_heightmap(tmp_path / "h.tif", size_x_m=1, size_z_m=1, height_m=None)
    assert field.heights_m[7, 3] == pytest.approx(27.0)
    assert len(warnings) == 1 and "1 pixel" in warnings[0] and "(3, 7)" in warnings[0]


def test_filling_keeps_what_is_known_and_stays_between_it() -> None:
    rng = np.random.default_rng(3)
    heights, known = rng.normal(size=(37, 52)), rng.random((37, 52)) < 0.3
    filled = fill_nodata(heights, known)
    assert np.array_equal(filled[known], heights[known])
    assert heights[known].min() <= filled.min() and filled.max() <= heights[known].max()
    assert np.array_equal(filled, fill_nodata(heights, known))


def test_a_hole_in_a_plain_is_filled_with_the_plain() -> None:
    """However wide, and whatever lies in it; a slope runs on through it."""
    hole = np.zeros((96, 80), bool)
    hole[9:85, 5:70] = True
    assert np.allclose(fill_nodata(np.where(hole, np.nan, 7.5), ~hole), 7.5, atol=1e-9)
    ramp = np.broadcast_to(np.arange(80.0), (96, 80))
    filled = fill_nodata(np.where(hole, -1e6, ramp), ~hole)
    assert np.abs(filled - ramp).max() < 0.15 * 79
    known = np.ones((20, 30), bool)  # holes at every border: what lies on the other side does not count
    known[4:7, 0] = known[4:7, -1] = known[0, 9:12] = known[-1, 9:12] = False
    both = np.add.outer(np.arange(20.0), np.arange(30.0))
    assert np.abs(fill_nodata(both, known) - both)[~known].max() < 2.0


def test_a_geotiff_is_metres_with_its_declared_nodata_filled(tmp_path: Path) -> None:
    heights = slope(20).astype(np.float32)
    heights[4:6, 9] = -9999.0
    path = tiff(tmp_path / "h.tif", heights, "-9999")
    field, warnings = read_heightmap(path, size_x_m=1, size_z_m=1, height_m=None)
    assert field.heights_m[4, 9] == pytest.approx(30.0, abs=1.0)
    assert np.array_equal(field.heights_m[:4], heights[:4])
    assert len(warnings) == 1 and "2 pixels" in warnings[0] and "(9, 4)" in warnings[0]


@pytest.mark.parametrize("big", [False, True])
def test_of_a_large_geotiff_its_tags_alone_are_read(tmp_path: Path, big: bool) -> None:
    path = tiff(tmp_path / "h.tif", slope(20).astype(np.float32), "-9999", big=big, keys=[1, 1, 0, 0])
    os.truncate(path, 1 << 28)
    tracemalloc.start()
    try:
        assert read_geotiff_tags(path).nodata == -9999.0
        check_damage(path, "tiff")
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def test_nodata_of_a_16_bit_tiff_is_a_code(tmp_path: Path) -> None:
    codes = (slope(12) * 100).astype(np.uint16)
    codes[3, 3] = 65535
    path = tiff(tmp_path / "h.tif", codes, "65535")
    field, warnings = read_heightmap(path, size_x_m=1, size_z_m=1, height_m=65.535)
    assert field.heights_m[3, 3] == pytest.approx(1.5, abs=0.2) and len(warnings) == 1
    assert field.heights_m[11, 11] == pytest.approx(5.5, abs=1e-5)


@pytest.mark.parametrize(("top", "kind"), [(65535, ">u2"), (255, "u1")])
def test_a_pgm_spans_black_to_white(tmp_path: Path, top: int, kind: str) -> None:
    codes = np.array([[0, top], [top // 5, 1]])
    path = tmp_path / "h.pgm"
    path.write_bytes(b"P5\n2 2\n%d\n" % top + codes.astype(kind).tobytes())
    field, warnings = read_heightmap(path, size_x_m=1, size_z_m=1, height_m=10.0, base_m=-2.0)
    assert field.heights_m == pytest.approx(codes / top * 10.0 - 2.0, abs=1e-6)
    assert len(warnings) == (1 if top == 255 else 0)


@pytest.mark.parametrize("alpha", [None, np.float16, np.float32, np.uint32])
def test_whole_numbers_in_an_exr_span_0_to_h_whatever_stands_beside_them(
    tmp_path: Path, alpha: type[np.generic] | None
) -> None:
    """A channel of another type made OpenImageIO hand all of them over as floats, and floats are metres."""
    codes = (np.linspace(21.0 / 49.0, 24.0 / 49.0, 64).reshape(8, 8) * (2.0**32 - 1)).astype(np.uint32)
    channels: dict[str, npt.NDArray[np.generic]] = {"Y": codes}
    if alpha is not None:
        channels["A"] = np.full((8, 8), 2**32 - 1 if alpha is np.uint32 else 1, alpha)
    field, _ = read_heightmap(exr(tmp_path / "h.exr", channels), size_x_m=1, size_z_m=1, height_m=49.0)
    assert np.abs(field.heights_m - codes / (2.0**32 - 1) * 49.0).max() < 3e-6


@pytest.mark.parametrize("name", ["h.exr", "h.tif"])
def test_floats_are_metres_bit_for_bit(tmp_path: Path, name: str) -> None:
    heights = np.array([[1e-6, -1e6], [0.1, 3.0]], np.float32)
    if name == "h.tif":
        tiff(tmp_path / name, heights)
    else:
        out = oiio.ImageOutput.create(str(tmp_path / name))
        assert out and out.open(str(tmp_path / name), oiio.ImageSpec(2, 2, 1, "float"))
        assert out.write_image(heights[:, :, None])
        out.close()
    field, _ = read_heightmap(tmp_path / name, size_x_m=1, size_z_m=1, height_m=None)
    assert np.array_equal(field.heights_m, heights)


def test_infinity_is_refused_with_its_place(tmp_path: Path) -> None:
    heights = slope(9).astype(np.float32)
    heights[2, 7] = np.inf
    with pytest.raises(SourceError, match=r"\(7, 2\)"):
        read_heightmap(tiff(tmp_path / "h.tif", heights), size_x_m=1, size_z_m=1, height_m=1.0)
    with pytest.raises(SourceError, match=r"\(7, 2\)"):
        read_heightmap(tiff(tmp_path / "v.tif", heights, "-9999"), size_x_m=1, size_z_m=1, height_m=1.0)


def test_a_tile_whose_colours_are_digits_of_heights_is_refused_with_what_reads_it(
    tmp_path: Path,
) -> None:
    metres = np.round(slope(33) * 8 + 32768 + 900).astype(int)
    codes = np.stack([metres // 256, metres % 256, np.zeros_like(metres)], axis=2)
    path = png(tmp_path / "terrarium.png", codes, 2, 8)
    with pytest.raises(
        SourceError, match=r"digits, say which \(--encoding terrarium or terrain-rgb; in a scene encoding\)"
    ):
        read_heightmap(path, size_x_m=1.0, size_z_m=1.0, height_m=None)


@pytest.mark.parametrize("kind", ["png 8", "png 16", "exr", "exr of NaN"])
@pytest.mark.parametrize("steps", [2, 8])
def test_a_picture_whose_colours_are_rounded_each_by_itself_is_grey(
    tmp_path: Path, kind: str, steps: int
) -> None:
    """Programs of pictures make grey of three colours that differ by a step or two of 255."""
    red = np.clip(slope(33) * 255 / 160, 0, 255)
    green = np.clip(red + steps * (np.indices(red.shape).sum(axis=0) % 2), 0, 255)
    if kind.startswith("png"):
        bits = int(kind[4:])
        unit = 257 if bits == 16 else 1
        codes = np.round(np.stack([red, green, red], axis=2)).astype(int) * unit
        path = png(tmp_path / "a.png", codes, 2, bits)
        truth = np.rint(codes @ np.array(BT709)) / (255 * unit)
    else:
        truth = (red * 4.0 - 100.0).astype(np.float32)
        if "NaN" in kind:
            truth[3, 4] = np.nan
        more = truth + (green - red).astype(np.float32) * np.float32(4.0)
        path = exr(tmp_path / "a.exr", {"R": truth, "G": more, "B": truth})
        truth = (np.stack([truth, more, truth], axis=2) @ np.array(BT709)).astype(np.float32)
    height_m = 1.0 if kind.startswith("png") else None
    if steps > 2:
        with pytest.raises(SourceError, match="is a colour picture"):
            read_heightmap(path, size_x_m=1.0, size_z_m=1.0, height_m=height_m)
        return
    field, warnings = read_heightmap(path, size_x_m=1.0, size_z_m=1.0, height_m=height_m)
    known = np.isfinite(truth)
    assert np.abs(field.heights_m - truth)[known].max() < 1e-6
    told = [text for text in warnings if "is not quite grey" in text]
    assert len(told) == 1 and "differ by up to 0.0078 of their range); their mean is read" in told[0]
    image = read_image(path, color_space="data", finite=False)
    grey, _ = with_heights(image, path, "auto")  # as maps of heights read it
    assert grey.values.shape == (33, 33, 1) and grey.top == image.top
