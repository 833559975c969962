"""Raw SRTM tiles and pixels without a height: read, filled from their surroundings, and told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.errors import SourceError
from paradize.readers.heightmap import read_heightmap
from paradize.readers.nodata import fill_nodata


def slope(side: int) -> npt.NDArray[np.float64]:
    return np.asarray(np.add.outer(3.0 * np.arange(side), 2.0 * np.arange(side)), np.float64)


def test_an_srtm_tile_is_metres_with_its_voids_filled(tmp_path: Path) -> None:
    heights = slope(33).astype(">i2")
    heights[10:14, 20:25] = -32768
    path = tmp_path / "N00E000.hgt"
    path.write_bytes(heights.tobytes())
    field, warnings = read_heightmap(path, size_x_m=1, size_z_m=1, height_m=99.0)
    assert np.abs(field.heights_m - slope(33)).max() < 1.5
    known = heights != -32768
    assert np.array_equal(field.heights_m[known], slope(33)[known])
    assert len(warnings) == 1 and "20 pixels" in warnings[0] and "(20, 10)" in warnings[0]


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
    field, warnings = read_heightmap(tmp_path / "h.tif", size_x_m=1, size_z_m=1, height_m=1.0)
    assert field.heights_m[7, 3] == pytest.approx(27.0)
    assert len(warnings) == 1 and "1 pixels" in warnings[0] and "(3, 7)" in warnings[0]


def test_filling_keeps_what_is_known_and_stays_between_it() -> None:
    rng = np.random.default_rng(3)
    heights, known = rng.normal(size=(37, 52)), rng.random((37, 52)) < 0.3
    filled = fill_nodata(heights, known)
    assert np.array_equal(filled[known], heights[known])
    assert heights[known].min() <= filled.min() and filled.max() <= heights[known].max()
    assert np.array_equal(filled, fill_nodata(heights, known))
