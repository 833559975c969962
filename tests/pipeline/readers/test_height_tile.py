"""Tiles of web maps: the digits in their colours are read as metres, and what cannot be digits is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Pillow

from paradize.data import Heightfield, Image
from paradize.errors import SourceError
from paradize.readers.height_tile import metres_of_tile
from paradize.readers.heightmap import read_heightmap
from tests.pipeline.raw_files import png

F64 = npt.NDArray[np.float64]

# As the papers of both encodings say them: the colours of a few heights, in metres.
PUBLISHED = {
    "terrarium": {(128, 0, 0): 0.0, (127, 255, 255): -1 / 256, (162, 148, 128): 8852.5, (0, 0, 0): -32768.0},
    "terrain-rgb": {(1, 134, 160): 0.0, (0, 0, 0): -10000.0, (2, 224, 20): 8843.6, (1, 134, 159): -0.1},
}


def read(path: Path, encoding: str, **more: float) -> tuple[Heightfield, list[str]]:
    return read_heightmap(path, size_x_m=1.0, size_z_m=1.0, height_m=None, encoding=encoding, **more)


def colors_of(metres: F64, encoding: str) -> npt.NDArray[np.int64]:
    """The inverse of the papers' formulas, in whole numbers."""
    steps = (metres + 32768) * 256 if encoding == "terrarium" else (metres + 10000) * 10
    codes = np.rint(steps).astype(np.int64)
    return np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=2)


def slope() -> F64:
    return 700.0 + np.add.outer(2.5 * np.arange(16), np.arange(16) / 2.0)


@pytest.mark.parametrize("encoding", PUBLISHED)
def test_published_colours_are_their_heights(encoding: str, tmp_path: Path) -> None:
    colors = np.array([list(PUBLISHED[encoding])], np.uint8)
    path = png(tmp_path / "a.png", colors, 2, 8)
    metres = metres_of_tile(Image(colors, "data", 8, top=255), path, encoding)
    assert metres.values[0, :, 0] == pytest.approx(list(PUBLISHED[encoding].values()), rel=1e-6, abs=1e-4)
    assert metres.top is None


@given(st.integers(0, 2**24 - 1), st.sampled_from(list(PUBLISHED)))
def test_every_colour_is_the_nearest_float_of_its_height(code: int, encoding: str) -> None:
    colors = np.array([[[code >> 16, code >> 8 & 255, code & 255]]], np.uint8)
    metres = metres_of_tile(Image(colors, "data", 8, top=255), Path(__file__), encoding).values[0, 0, 0]
    truth = code / 256 - 32768 if encoding == "terrarium" else code / 10 - 10000
    assert abs(float(metres) - truth) <= 0.5 * float(np.spacing(np.float32(abs(truth)))) + 1e-9


@pytest.mark.parametrize("encoding", PUBLISHED)
def test_a_tile_is_scaled_and_raised_and_told_by_its_step(encoding: str, tmp_path: Path) -> None:
    path = png(tmp_path / "a.png", colors_of(slope(), encoding), 2, 8)
    field, warnings = read(path, encoding, height_scale=-2.0, base_m=5.0)
    assert np.allclose(field.heights_m, 5.0 - 2.0 * slope(), atol=1e-3) and not warnings
    assert field.step_m == pytest.approx(2.0 / 256 if encoding == "terrarium" else 0.2)


@pytest.mark.parametrize("encoding", PUBLISHED)
def test_black_and_transparent_pixels_of_a_tile_have_no_height(encoding: str, tmp_path: Path) -> None:
    """Servers write black where they know no height."""
    colors = np.dstack([colors_of(slope(), encoding), np.full((16, 16), 255)])
    colors[3, 4:6, :3] = 0
    colors[8, 9, 3] = 0
    colors[8, 10, 3] = 1
    field, warnings = read(png(tmp_path / "a.png", colors, 6, 8), encoding)
    assert np.abs(field.heights_m - slope()).max() < 3.0
    assert [text for text in warnings if "2 pixels without a height" in text and "(4, 3)" in text]
    assert [text for text in warnings if "1 pixel without a height" in text and "(9, 8)" in text]


def test_the_other_encoding_is_suspected_where_no_land_is_that_high(tmp_path: Path) -> None:
    path = png(tmp_path / "a.png", colors_of(slope(), "terrarium"), 2, 8)
    (warning,) = read(path, "terrain-rgb")[1]
    assert "more than the Earth (-12000 to 9000 m): is it terrarium, or a picture of" in warning
    (warning,) = read(png(path, colors_of(slope(), "terrain-rgb"), 2, 8), "terrarium")[1]
    assert "spans -32350 to -32348.3 m as terrarium" in warning and "is it terrain-rgb" in warning


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("grey.png", "has 1 channel of 8 bits"),
        ("alpha.png", "has 2 channels of 8 bits"),
        ("a.jpg", "is a JPEG"),
        ("a.webp", "is a lossy WebP"),
    ],
)
def test_pictures_that_hold_no_digits_are_refused(tmp_path: Path, name: str, said: str) -> None:
    colors = colors_of(slope(), "terrarium").astype(np.uint8)
    held = {"grey.png": colors[:, :, 1], "alpha.png": colors[:, :, :2]}.get(name, colors)
    Pillow.fromarray(held).save(tmp_path / name)
    with pytest.raises(SourceError, match=said) as caught:
        read(tmp_path / name, "terrarium")
    assert "take the tile" in str(caught.value)


def test_a_lossless_webp_keeps_the_digits(tmp_path: Path) -> None:
    colors = colors_of(slope(), "terrarium").astype(np.uint8)
    Pillow.fromarray(colors).save(tmp_path / "a.webp", lossless=True)
    assert np.allclose(read(tmp_path / "a.webp", "terrarium")[0].heights_m, slope(), atol=1e-3)


def test_a_real_tile_spans_the_heights_that_its_corpus_states(corpus: Path) -> None:
    field, warnings = read(corpus / "height" / "terrarium_256_rgb.png", "terrarium")
    span = float(field.heights_m.min()), float(field.heights_m.max())
    assert span == pytest.approx((852.1172, 2475.0664), abs=1e-4) and not warnings
