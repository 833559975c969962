"""Pictures of colour and metalness are made of glTF's older model of light: gold beside wood is both."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from paradize.build.materials.metal_pictures import with_metal_pictures
from paradize.errors import SourceError
from paradize.formats.png import decode_png
from paradize.kernels.math import linear_to_srgb, srgb_to_linear
from paradize.material import MapSource, Material, Picture, Reflected
from tests.pipeline.scenes import write_image

GOLD, WOOD, PLASTIC = (1.0, 0.766, 0.336), (0.4, 0.2, 0.1), (0.04, 0.04, 0.04)
WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
F64 = npt.NDArray[np.float64]


def halves(path: Path, left: tuple[float, ...], right: tuple[float, ...], side: int = 16) -> MapSource:
    """A picture whose left half has one linear colour, and its right half another."""
    light = np.zeros((side, side, 3))
    light[:, : side // 2], light[:, side // 2 :] = left, right
    write_image(path, np.rint(255.0 * linear_to_srgb(light)).astype(np.uint8))
    return MapSource(Picture(path, name=path.name), srgb=True)


def linear(source: MapSource, folder: Path) -> F64:
    assert source.picture.data is not None
    (folder / "made.png").write_bytes(source.picture.data)
    codes = decode_png(folder / "made.png")
    return srgb_to_linear(codes / 255.0) if source.srgb else codes / 255.0


def made(
    diffuse: MapSource | None, reflected: MapSource, tint: tuple[float, float, float] = WHITE
) -> Material:
    maps = {"smoothness": MapSource(reflected.picture, "a")}
    maps |= {"color": diffuse} if diffuse else {}
    return with_metal_pictures(
        Material("a", (1.0, 0.5, 0.5), metalness=0.0, maps=maps, reflected=Reflected(reflected, tint))
    )


@pytest.mark.parametrize("side", [16, 8, 32])
def test_a_picture_of_gold_and_wood_is_gold_that_is_metal_beside_wood_that_is_not(
    tmp_path: Path, side: int
) -> None:
    """Pictures of two sizes are made one."""
    diffuse = halves(tmp_path / "d.png", BLACK, WOOD, side)
    found = made(diffuse, halves(tmp_path / "s.png", GOLD, PLASTIC))
    assert found.reflected is None and (found.color, found.metalness) == (WHITE, 1.0)
    assert found.maps.keys() == {"color", "metalness", "smoothness"}
    color, metal = (linear(found.maps[role], tmp_path) for role in ("color", "metalness"))
    assert color.shape[:2] == metal.shape[:2] == (max(side, 16),) * 2
    quarter = max(side, 16) // 4
    assert np.abs(color[:, quarter] - GOLD).max() < 0.01 and metal[:, quarter].min() == 1.0
    wood = np.array(WOOD) * (1.0, 0.5, 0.5)
    assert np.abs(color[:, 3 * quarter] - wood).max() < 0.01 and metal[:, 3 * quarter].max() < 0.02


def test_without_a_picture_of_colour_both_factors_count(
    tmp_path: Path,
) -> None:
    reflected = halves(tmp_path / "s.png", WHITE, BLACK)
    found = made(None, reflected, GOLD)
    color, metal = (linear(found.maps[role], tmp_path) for role in ("color", "metalness"))
    assert np.abs(color[:, 2] - GOLD).max() < 0.01 and metal[:, 2].min() > 0.98
    assert np.abs(color[:, 12] - (1.0, 0.5, 0.5)).max() < 0.01 and metal[:, 12].max() == 0.0


def test_a_material_that_reflects_as_plastic_everywhere_keeps_its_pictures(tmp_path: Path) -> None:
    diffuse = halves(tmp_path / "d.png", WOOD, GOLD)
    found = made(diffuse, halves(tmp_path / "s.png", PLASTIC, BLACK))
    assert found.reflected is None and found.maps["color"] == diffuse and "metalness" not in found.maps
    assert (found.color, found.metalness) == ((1.0, 0.5, 0.5), 0.0)


def test_a_picture_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "s.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    broken = MapSource(Picture(tmp_path / "s.png", name="s.png"), srgb=True)
    with pytest.raises(SourceError, match=r"s\.png"):
        made(None, broken)
