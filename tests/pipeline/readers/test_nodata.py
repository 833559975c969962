"""Numbers that are no heights though no file says so: found, filled and told, or told alone; and by name."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from paradize.data import Heightfield
from paradize.errors import SourceError
from paradize.readers.heightmap import Nodata, read_heightmap
from tests.pipeline.raw_files import tiff

FLOAT_MAX = float(np.finfo(np.float32).max)


def hills(low: float, high: float, side: int = 48) -> npt.NDArray[np.float64]:
    y, x = np.mgrid[0:side, 0:side] / side
    waves = np.sin(5 * x + 1) * np.cos(4 * y) + 0.3 * np.sin(17 * x * y)
    return low + (waves - waves.min()) / np.ptp(waves) * (high - low)


def read(path: Path, nodata: Nodata = "auto", height_m: float | None = None) -> tuple[Heightfield, list[str]]:
    return read_heightmap(path, size_x_m=1, size_z_m=1, height_m=height_m, nodata=nodata)


def holed(heights: npt.NDArray[Any], value: float, kind: Any = np.float32) -> npt.NDArray[Any]:
    holes = heights.astype(kind)
    with np.errstate(over="ignore"):
        holes[10:13, 20:25] = np.array(value).astype(kind)
    return holes


@pytest.mark.parametrize(
    "value", [-9999, -99999, -999, -32768, -32767, -FLOAT_MAX, FLOAT_MAX, 1e20, -12345.5]
)
@pytest.mark.parametrize("span", [(500.0, 900.0), (-90.0, 4000.0)])
def test_what_can_be_no_height_is_filled_and_told(
    tmp_path: Path, value: float, span: tuple[float, float]
) -> None:
    truth = hills(*span)
    heights = holed(truth, value)
    if value == -12345.5 and span[1] > 900.0:
        span, truth = (500.0, 1500.0), hills(500.0, 1500.0)
        heights = holed(truth, value)
    field, (message,) = read(tiff(tmp_path / "h.tif", heights))
    whole = heights == truth.astype(np.float32)
    assert np.array_equal(field.heights_m[whole], truth.astype(np.float32)[whole])
    assert np.abs(field.heights_m - truth).max() < 0.15 * (span[1] - span[0])
    assert (
        "15 pixels" in message
        and "(20, 10)" in message
        and f"({np.float32(value):.10g}," in message
        and "none" in message
    )


def test_two_kinds_of_holes_are_told_apart(tmp_path: Path) -> None:
    heights = holed(hills(500, 900), -9999.0)
    heights[30, 40] = FLOAT_MAX
    heights[31, 40] = np.nan
    field, message = read(tiff(tmp_path / "h.tif", heights))
    assert field.heights_m.min() >= 500 and field.heights_m.max() <= 900
    assert [text.split("h.tif: ")[1].split(" without")[0] for text in message] == [
        "15 pixels",
        *["1 pixel"] * 2,
    ]


@pytest.mark.parametrize(
    ("low", "high", "value", "kind"),
    [
        (-10900, 8800, -9999, np.float32),  # a chart of the sea floor: depths around it are real
        (-9990, -9000, -9999, np.int16),  # a trench in whole metres, its deepest beside -9990
        (-1200, 300, -999, np.float32),
    ],
)
def test_a_height_among_its_like_stays_whatever_its_number(
    tmp_path: Path, low: float, high: float, value: float, kind: Any
) -> None:
    heights = holed(hills(low, high), value, kind)
    field, message = read(tiff(tmp_path / "h.tif", heights))
    assert np.array_equal(field.heights_m, heights.astype(np.float32)) and message == []


def test_a_plain_under_a_plateau_is_told_and_kept(tmp_path: Path) -> None:
    heights = holed(hills(500, 900), 0.0)
    field, (message,) = read(tiff(tmp_path / "h.tif", heights))
    assert (
        np.array_equal(field.heights_m, heights) and "0 lies far from" in message and "--nodata 0" in message
    )
    codes = holed(hills(30000, 40000), 0, np.uint16)
    field, (message,) = read(tiff(tmp_path / "c.tif", codes), height_m=65.535)
    assert field.heights_m.min() == 0 and "--nodata 0" in message
    calm = np.maximum(hills(-300, 900), 0.0).astype(np.float32)  # the sea at 0 m
    assert read(tiff(tmp_path / "sea.tif", calm))[1] == []


@pytest.mark.parametrize(
    ("value", "where"), [(0.0, "together"), (0.0, "apart"), (0.0, "one"), (9999.0, "one")]
)
def test_a_number_apart_from_all_heights_is_told_however_few_pixels_hold_it(
    tmp_path: Path, value: float, where: str
) -> None:
    heights = hills(400, 900).astype(np.float32)
    at = {"together": np.arange(200, 220), "apart": np.arange(5, 2000, 211), "one": np.array([777])}[where]
    heights.flat[at] = value
    field, (message,) = read(tiff(tmp_path / "h.tif", heights))
    assert np.array_equal(field.heights_m, heights)
    assert f"{value:g} lies far from" in message and f"--nodata {value:g}" in message


@pytest.mark.parametrize(
    ("low", "high", "value"),
    [(500, 2000, -12345.5), (500, 600, -5000.5)],  # eight times the range away; within 9,000 m
)
def test_numbers_that_only_one_sign_says_are_no_heights_are_told_and_kept(
    tmp_path: Path, low: float, high: float, value: float
) -> None:
    heights = holed(hills(low, high), value)
    field, (message,) = read(tiff(tmp_path / "h.tif", heights))
    assert np.array_equal(field.heights_m, heights) and f"{value:g} lies far from" in message


def test_two_pixels_stand_apart_at_a_quarter_of_the_range_and_one_at_half_of_it(tmp_path: Path) -> None:
    for value, count, result in ((200, 1, 0), (200, 2, 1), (300, 2, 0), (100, 1, 1)):  # of 400 to 900
        heights = hills(400, 900).astype(np.float32)
        heights.flat[np.arange(count) + 500] = value
        assert len(read(tiff(tmp_path / "h.tif", heights))[1]) == result, (value, count)


def test_of_fewer_than_64_pixels_none_stands_apart(tmp_path: Path) -> None:
    for side, result in ((7, 0), (8, 1)):
        heights = hills(400, 900, side).astype(np.float32)
        heights[2, 3] = 0.0
        assert len(read(tiff(tmp_path / "h.tif", heights))[1]) == result


def test_terraces_and_a_summit_stand_apart_from_nothing(tmp_path: Path) -> None:
    for steps in (3, 4, 5, 9):
        terraces = np.rint(hills(0, steps - 1)) * (1000.0 / (steps - 1))
        assert read(tiff(tmp_path / "h.tif", terraces.astype(np.float32)))[1] == []
    deep = np.rint(hills(-1, 4)) * 200.0 + 400.0
    deep[deep == 200.0] = 0.0  # twice as deep as the others are high
    assert read(tiff(tmp_path / "h.tif", deep.astype(np.float32)))[1] == []
    y, x = np.mgrid[-24:24, -24:24]
    cone = 900.0 - 20.0 * np.hypot(x, y)
    assert read(tiff(tmp_path / "c.tif", cone.astype(np.float32)))[1] == []


def test_nodata_by_name_is_what_is_filled_and_none_fills_nothing(tmp_path: Path) -> None:
    heights = holed(hills(500, 900), 0.0)
    path = tiff(tmp_path / "h.tif", heights)
    field, (result,) = read(path, 0.0)
    assert field.heights_m.min() >= 500 and "15 pixels" in result and "(0, as given)" in result
    field, (result,) = read(path, -1.0)
    assert field.heights_m.min() == 0 and "no pixel holds -1" in result
    marked = tiff(tmp_path / "m.tif", holed(hills(500, 900), -9999.0), "-9999")
    field, no_warnings = read(marked, "none")
    assert field.heights_m.min() == -9999 and no_warnings == []
    codes = tiff(tmp_path / "c.tif", holed(hills(30000, 40000), 65535, np.uint16))
    field, (result,) = read(codes, 65535, height_m=65.535)
    assert field.heights_m.max() < 40.001 and "(65535, as given)" in result


@pytest.mark.parametrize("values", [[-9999.0], [-32768.0], [FLOAT_MAX], [-9999.0, -32768.0]])
def test_a_picture_of_nothing_but_markers_has_no_heights(tmp_path: Path, values: list[float]) -> None:
    path = tiff(tmp_path / "h.tif", np.resize(np.array(values, np.float32), (8, 8)))
    with pytest.raises(SourceError, match="no height in any pixel") as caught:
        read(path)
    listed = caught.value.what.partition("each is ")[2].split(" or ")
    assert sorted(listed) == sorted(f"{np.float32(value):.10g}" for value in values)
    assert "--nodata none" in str(caught.value.mend)
    if max(values) < 0.0:
        field, warnings = read(path, "none")
        assert field.heights_m.min() == min(values)
        assert [text for text in warnings if "the ground is flat" not in text] == []


# --- what a GeoTIFF says of its numbers ---------------------------------------------------------------------


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("-9999", -9999.0),
        ("nan", np.nan),
        ("-3.4028234663852886e+38", -FLOAT_MAX),
        (" 7.5 ", 7.5),
        ("0", 0.0),
    ],
)
def test_declared_nodata_is_read_in_every_form(
    tmp_path: Path, order: str, big: bool, text: str, value: float
) -> None:
    truth = hills(500, 900)
    path = tiff(tmp_path / "h.tif", holed(truth, value), text.strip(), order=order, big=big)
    field, (result,) = read(path)
    assert "15 pixels" in result and np.abs(field.heights_m - truth).max() < 60


def item(role: str, text: str) -> str:
    return f'<Item name="{role.upper()}" sample="0" role="{role}">{text}</Item>'


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", [np.uint16, np.int16, np.float32, np.uint32])
def test_stated_scale_offset_and_unit_make_metres(tmp_path: Path, kind: Any, order: str) -> None:
    numbers = hills(0, 30000).astype(kind)
    said = (
        f"<GDALMetadata>{item('scale', '0.1')}{item('offset', '-50')}{item('unittype', 'ft')}"
        f"{item('scale', '7').replace('0', '1')}</GDALMetadata>"  # of another band
    )
    path = tiff(tmp_path / "h.tif", numbers, order=order, metadata=said)
    field, (result,) = read(path)
    oracle = (np.asarray(Image.open(path), np.float64) * 0.1 - 50) * 0.3048 if kind != np.uint32 else None
    truth = (numbers.astype(np.float64) * 0.1 - 50) * 0.3048
    assert oracle is None or np.array_equal(oracle, truth)
    assert np.abs(field.heights_m - truth).max() <= 6.1e-5 * (2 if kind == np.uint32 else 1)
    assert "scale 0.1, offset -50, unit foot" in result


@pytest.mark.parametrize("scale", ["nan", "1e300"])
def test_a_scale_that_leaves_no_finite_heights_is_told_instead_of_a_pixel(tmp_path: Path, scale: str) -> None:
    said = f"<GDALMetadata>{item('scale', scale)}</GDALMetadata>"
    path = tiff(tmp_path / "h.tif", hills(500, 900).astype(np.float32), metadata=said)
    with pytest.raises(
        SourceError, match=r"as the file says \(scale .*\), and are not finite then; save the h"
    ):
        read(path)


@pytest.mark.parametrize(("epsg", "unit_m"), [(9001, 1.0), (9002, 0.3048), (9003, 1200 / 3937)])
def test_the_vertical_unit_of_a_geotiff_counts(tmp_path: Path, epsg: int, unit_m: float) -> None:
    heights = hills(500, 900).astype(np.float32)
    keys = [1, 1, 0, 2, 1024, 0, 1, 1, 4099, 0, 1, epsg]
    field, message = read(tiff(tmp_path / "h.tif", heights, keys=keys))
    assert np.array_equal(field.heights_m, (heights.astype(np.float64) * unit_m).astype(np.float32))
    assert len(message) == (0 if epsg == 9001 else 1)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.uint32, np.int16, np.float32])
@pytest.mark.parametrize("order", ["<", ">"])
def test_every_kind_of_number_of_a_tiff_is_what_pillow_reads(tmp_path: Path, kind: Any, order: str) -> None:
    numbers = hills(0, 250).astype(kind)
    path = tiff(tmp_path / "h.tif", numbers, order=order)
    oracle = np.asarray(Image.open(path), np.float64) if kind != np.uint32 else numbers.astype(np.float64)
    codes = np.dtype(kind).kind == "u"
    field, _ = read(path, height_m=1000.0 if codes else None)
    truth = oracle / float(np.iinfo(kind).max) * 1000.0 if codes else oracle
    assert np.abs(field.heights_m - truth).max() <= 6e-8 * np.abs(truth).max()


# --- metres and --height ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [np.float32, np.int16])
def test_a_height_given_for_metres_is_told_and_a_scale_stretches_them(tmp_path: Path, kind: Any) -> None:
    heights = hills(5, 90).astype(kind)
    path = tiff(tmp_path / "h.tif", heights)
    field, (result,) = read(path, height_m=300.0)
    assert np.array_equal(field.heights_m, heights.astype(np.float32))
    assert "300 m, has no effect" in result and "--scale" in result
    scaled, none = read_heightmap(
        path, size_x_m=1, size_z_m=1, height_m=None, height_scale=0.3048, base_m=2.0
    )
    assert np.array_equal(scaled.heights_m, (heights.astype(np.float64) * 0.3048 + 2).astype(np.float32))
    assert none == []


def test_codes_need_a_height_and_say_where_they_use_little_of_it(tmp_path: Path) -> None:
    path = tiff(tmp_path / "h.tif", hills(852, 2475).astype(np.uint16))
    with pytest.raises(SourceError, match="--height H"):
        read(path)
    field, (result,) = read(path, height_m=1000.0)
    assert field.heights_m.max() == pytest.approx(1000 * 2475 / 65535, abs=0.02)
    assert "2475 of 65535" in result and "65535 m" in result
    wide = tiff(tmp_path / "w.tif", (1000 * np.rint(hills(396, 813))).astype(np.uint32))
    _, (result,) = read(wide, height_m=1000.0)
    assert "the largest integer is 813000 of 4294967295" in result
    assert result.endswith("if the integers are metres, save them as floats")  # --height takes 1e6 at most


@pytest.mark.deep
def test_the_command_takes_metres_without_a_height(tmp_path: Path, paradize_here: Callable[..., Any]) -> None:
    path = tiff(tmp_path / "h.tif", holed(hills(500, 900), 0.0))
    out = tmp_path / "t.glb"
    done = paradize_here(
        "terrain", path, "-o", out, "--size", 100, 100, "--nodata", 0, "--scale", 2, "--json"
    )
    report = json.loads(done.stdout)
    assert done.returncode == 0 and 0.0 < report["max_error_m"] <= 0.8 and report["triangles"] < 4418
    assert "15 pixels" in report["warnings"][0] and len(report["warnings"]) == 1
    other = paradize_here(
        "terrain", path, "-o", out, "--size", 100, 100, "--nodata", 0, "--height", 3, "--json"
    )
    assert "has no effect" in other.stderr  # nor does it say how near the mesh must be
    assert json.loads(other.stdout)["bound_m"] == pytest.approx(0.5 * report["bound_m"], rel=1e-6)
    codes = tiff(tmp_path / "c.tif", hills(0, 65535).astype(np.uint16))
    done = paradize_here("terrain", codes, "-o", out, "--size", 100, 100)
    assert done.returncode == 1 and "--height H" in done.stderr
    done = paradize_here("terrain", codes, "-o", out, "--size", 100, 100, "--height", 3, "--nodata", "void")
    assert done.returncode == 2 and "'void' is not a number" in done.stderr
