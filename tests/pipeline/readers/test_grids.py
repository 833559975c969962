"""Grids of heights that are no pictures: ASCII grids and raw numbers are read, what is guessed is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paradize.data import Heightfield
from paradize.errors import SourceError
from paradize.readers.heightmap import read_heightmap
from tests.pipeline.readers.test_terrain_sources import slope

HEADER = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n"


def heights(path: Path, height_m: float | None = None) -> tuple[Heightfield, list[str]]:
    return read_heightmap(path, size_x_m=1.0, size_z_m=1.0, height_m=height_m)


def grid(folder: Path, text: str | bytes, name: str = "a.asc") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("bom", [b"", b"\xef\xbb\xbf"])
def test_an_ascii_grid_is_metres_from_the_north_row_on(tmp_path: Path, newline: str, bom: bytes) -> None:
    text = HEADER.replace("ncols", " NCOLS ") + "1.5 -2 3e1\n\t4 5 6 \n\n"
    field, warnings = heights(grid(tmp_path, bom + text.replace("\n", newline).encode(), "a.txt"))
    assert field.heights_m.tolist() == [[1.5, -2.0, 30.0], [4.0, 5.0, 6.0]]
    assert not field.step_m and not warnings


@pytest.mark.parametrize("name", ["NODATA_value", "nodata"])
def test_the_no_data_value_of_an_ascii_grid_is_filled_and_told(tmp_path: Path, name: str) -> None:
    path = grid(tmp_path, HEADER + f"{name} 0\n1 0 1\n1 1 2\n")
    field, warnings = heights(path)
    (west, filled, east), south = field.heights_m
    assert [west, east, *south] == [1, 1, 1, 1, 2] and 1.0 <= filled <= 2.0
    assert len(warnings) == 1 and "1 pixel without a height (0, as the file says)" in warnings[0]


def test_a_row_that_begins_with_a_word_that_is_a_number_is_no_line_of_the_header(tmp_path: Path) -> None:
    field, _ = heights(grid(tmp_path, HEADER.replace("3", "2") + "nan 5\n5 5\n"))
    assert field.heights_m.tolist() == [[5, 5], [5, 5]]


def test_ascii_grids_of_the_corpus_are_the_pictures_that_were_made_of_them(corpus: Path) -> None:
    """MANIFEST.md: 0..65535 of the picture is 1660 to 1711 m."""
    field, _ = heights(corpus / "height/hugo_site.asc")
    picture, _ = heights(corpus / "height/hugo_site_16.png", 51.0)
    known = picture.heights_m > 0.0
    assert np.abs(field.heights_m - 1660.0 - picture.heights_m)[known].max() < 51.0 / 65535


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEADER + "1 2 3 4 5\n", r"5 heights; its header says 3 x 2; export it again .* it may be cut"),
        (HEADER + "1 2 3 4 5 6 7\n", r"7 heights; its header says 3 x 2"),
        (HEADER + "1 2 3 4 5,5 6\n", r"row 2, column 2: '5,5' is not a number; numbers need decimal points"),
        (HEADER + "1 2 3 4 1_0 6\n", r"row 2, column 2: '1_0' is not a number"),
        (HEADER.replace("3", "1") + "1 2\n", r"header: ncols '1'; expected 2 to 16385"),
        (HEADER.replace("3", "99999") + "1 2\n", r"header: ncols '99999'; expected 2 to 16385"),
        (
            HEADER.replace("3", "16385").replace("nrows 2", "nrows 16385"),
            r"bytes of heights; its header says 16385 x 16385",
        ),
        (HEADER.replace("nrows 2\n", "") + "1 2 3\n", r"header: nrows is missing; expected 2 to 16385"),
        (HEADER + "NODATA_value none\n1 2 3 4 5 6\n", r"NODATA_value 'none', expected a number"),
        (HEADER + "1 2 3 4 inf 6\n", r"pixel \(1, 1\): holds infinity"),
        (
            HEADER + "NODATA_value 7\n7 7 7 7 7 7\n",
            r"has no height in any pixel: each is 7;",
        ),
        (HEADER + "nan nan nan nan nan nan\n", r"has no height in any pixel: each is NaN; save the heights"),
    ],
)
def test_a_broken_ascii_grid_is_refused_with_its_place_and_a_mend(
    tmp_path: Path, text: str, said: str
) -> None:
    with pytest.raises(SourceError, match=said):
        heights(grid(tmp_path, text))


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    ("name", "kind"), [("a.raw", "u2"), ("a.r16", "u2"), ("a.raw", "f4"), ("a.r32", "f4")]
)
def test_raw_squares_are_read_in_the_order_of_bytes_that_is_smooth(
    tmp_path: Path, name: str, kind: str, order: str
) -> None:
    truth = slope(33) * 100
    path = grid(tmp_path, truth.astype(order + kind).tobytes(), name)
    field, warnings = heights(path, None if kind == "f4" else 65535.0)
    assert np.abs(field.heights_m - truth).max() < 1e-2
    said = f"{'low' if order == '<' else 'high'} byte first (guessed from its size and its numbers)"
    assert "read as 33 x 33 " in warnings[0] and said in warnings[0]


def test_raw_floats_that_are_signalling_nan_in_the_other_order_are_read(
    tmp_path: Path,
) -> None:
    codes = np.full((4, 4), 0x4120807F, "<u4")
    codes[0, 0] += 1
    field, warnings = heights(grid(tmp_path, codes.tobytes(), "a.r32"))
    assert np.allclose(field.heights_m, 10.03137)
    assert len(warnings) == 1 and "low byte first" in warnings[0]


def test_raw_heights_of_8_bits_made_16_stay_high(tmp_path: Path) -> None:
    """Their low bytes are 0, so that either order is as smooth."""
    codes = (np.add.outer(np.arange(16), np.arange(16)) * 256).astype("<u2")
    field, warnings = heights(grid(tmp_path, codes.tobytes(), "a.raw"), 65535.0)
    assert np.array_equal(field.heights_m, codes) and "not sure" in warnings[0]


def test_raw_heights_whose_order_nothing_tells_are_low_byte_first(tmp_path: Path) -> None:
    path = grid(tmp_path, np.full((4, 4), 0x0101, "<u2").tobytes(), "flat.raw")
    _, warnings = heights(path, 1.0)
    assert "low byte first (guessed from its size; the order is not sure)" in warnings[0]


@pytest.mark.parametrize(("side", "low", "high"), [(33, 0, 200), (64, 0, 200), (64, 62, 74)])
def test_raw_squares_of_8_bits_are_read(tmp_path: Path, side: int, low: int, high: int) -> None:
    """A square of 64 x 64 bytes has as many as one of 32 x 32 floats; of 62 to 74 they would be of 0.01 to
    1e6."""
    truth = np.round(low + slope(side) / slope(side).max() * (high - low)).astype(np.uint8)
    field, warnings = heights(grid(tmp_path, truth.tobytes(), "a.raw"), 255.0)
    assert np.array_equal(field.heights_m, truth)
    assert f"read as {side} x {side} unsigned integers of 8 bits (guessed" in warnings[0]
    assert "has 8 bits a pixel" in warnings[1]


def test_raw_8_bits_that_are_no_floats_of_heights_are_read_however_rough(tmp_path: Path) -> None:
    truth = np.random.default_rng(5).integers(0, 256, (64, 64), np.uint8)
    field, _ = heights(grid(tmp_path, truth.tobytes(), "a.raw"), 255.0)
    assert np.array_equal(field.heights_m, truth)


@pytest.mark.parametrize("kind", ["plain", "mostly 0", "mostly NaN", "whole metres", "flat"])
def test_raw_floats_are_not_taken_for_8_bits(tmp_path: Path, kind: str) -> None:
    truth = slope(64).astype("<f4") * 100 + 20
    island = truth > truth.max() - 3000
    if kind == "mostly 0":
        truth = np.where(island, truth, 0)
    elif kind == "mostly NaN":
        truth = np.where(island, truth, np.nan)
    elif kind == "whole metres":
        truth = np.round(truth)
    elif kind == "flat":
        truth = np.full_like(truth, 59.5)
    field, warnings = heights(grid(tmp_path, truth.astype("<f4").tobytes(), "a.raw"))
    assert "read as 64 x 64 floats (metres), low byte first" in " ".join(warnings)
    kept = np.isfinite(truth)
    assert np.array_equal(field.heights_m[kept], truth[kept])


@pytest.mark.parametrize("name", ["a.r16", "a.r32"])
def test_names_that_say_how_many_bits_are_believed(tmp_path: Path, name: str) -> None:
    with pytest.raises(SourceError, match="has 1089 bytes; only squares"):
        heights(grid(tmp_path, bytes(33 * 33), name), 1.0)


@pytest.mark.parametrize("size", [0, 1, 2, 10, 2 * 33 * 34])
def test_raw_heights_that_are_no_square_are_refused_with_a_mend(tmp_path: Path, size: int) -> None:
    with pytest.raises(
        SourceError, match=rf"has {size} bytes; only squares .* save the heights as a PNG or TIFF"
    ):
        heights(grid(tmp_path, bytes(size), "a.raw"))
