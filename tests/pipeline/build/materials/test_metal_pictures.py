"""Pictures of colour and metalness are made of glTF's older model of light: gold beside wood is both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from paradize.build.materials.metal_pictures import with_metal_pictures
from paradize.errors import SourceError
from paradize.formats.png import decode_png, encode_png
from paradize.kernels.math import linear_to_srgb, srgb_to_linear
from paradize.material import MapSource, Material, Picture, Reflected, Wrap

GOLD, WOOD, PLASTIC = (1.0, 0.766, 0.336), (0.4, 0.2, 0.1), (0.04, 0.04, 0.04)
WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
F64 = npt.NDArray[np.float64]


def halves(
    path: Path, left: tuple[float, ...], right: tuple[float, ...], side: int = 16, *, alpha: bool = True
) -> MapSource:
    """A picture whose left half has one linear colour, and its right half another."""
    light = np.zeros((side, side, 3))
    light[:, : side // 2], light[:, side // 2 :] = left, right
    codes = np.dstack([np.rint(255.0 * linear_to_srgb(light)), np.full((side, side), 90)])
    path.write_bytes(encode_png(codes[:, :, : 4 if alpha else 3].astype(np.uint8)))
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
    older = Material("a", (1.0, 0.5, 0.5), roughness=1.0, smoothness=0.75, metalness=0.0, maps=maps)
    return with_metal_pictures(replace(older, reflected=Reflected(reflected, tint)))


@pytest.mark.parametrize("side", [16, 8, 96])
def test_a_picture_of_gold_and_wood_is_gold_that_is_metal_beside_wood_that_is_not(
    tmp_path: Path, side: int
) -> None:
    """Pictures of two sizes are made one. Colours are the nearest codes of sRGB."""
    diffuse = halves(tmp_path / "d.png", BLACK, WOOD, side)
    found = made(diffuse, halves(tmp_path / "s.png", GOLD, PLASTIC))
    assert found.reflected is None and (found.color, found.metalness) == (WHITE, 1.0)
    assert found.maps.keys() == {"color", "metalness", "smoothness"}
    color, metal = (linear(found.maps[role], tmp_path) for role in ("color", "metalness"))
    assert color.shape[:2] == metal.shape[:2] == (max(side, 16),) * 2
    quarter = max(side, 16) // 4
    assert np.abs(color[:, quarter] - GOLD).max() < 0.01 and metal[:, quarter].min() == 1.0
    wood = linear_to_srgb(srgb_to_linear(np.rint(255.0 * linear_to_srgb(WOOD)) / 255.0) * (1.0, 0.5, 0.5))
    assert np.abs(linear_to_srgb(color[:, 3 * quarter]) - wood).max() < 0.501 / 255.0
    assert metal[:, 3 * quarter].max() < 0.02


@pytest.mark.parametrize(
    ("wrap", "is_mean"),
    [(None, True), (("repeat", "clamp"), True), (("clamp", "repeat"), False), (("mirror", "repeat"), False)],
)
def test_a_smaller_picture_is_enlarged_as_its_material_wraps(
    tmp_path: Path, wrap: tuple[Wrap, Wrap] | None, is_mean: bool
) -> None:
    """At the left border: its texels are black, those of the right border white."""
    diffuse = replace(halves(tmp_path / "d.png", BLACK, WHITE, 2), nearest=True)
    found = made(diffuse, replace(halves(tmp_path / "s.png", PLASTIC, GOLD), wrap=wrap))
    assert found.maps["color"].nearest and not found.maps["metalness"].nearest, "each keeps its sampler"
    assert linear(found.maps["color"], tmp_path)[8, 0, 0] == pytest.approx(0.4375 * is_mean, abs=0.01)


def test_without_a_picture_of_colour_both_factors_count(
    tmp_path: Path,
) -> None:
    reflected = halves(tmp_path / "s.png", WHITE, BLACK)
    found = made(None, reflected, GOLD)
    color, metal = (linear(found.maps[role], tmp_path) for role in ("color", "metalness"))
    assert np.abs(color[:, 2] - GOLD).max() < 0.01 and metal[:, 2].min() > 0.98
    assert np.abs(color[:, 12] - (1.0, 0.5, 0.5)).max() < 0.01 and metal[:, 12].max() == 0.0


@pytest.mark.parametrize("reflected", [PLASTIC, (0.05, 0.05, 0.05)])
def test_a_material_that_reflects_about_as_plastic_everywhere_keeps_its_pictures(
    tmp_path: Path, reflected: tuple[float, ...]
) -> None:
    diffuse = halves(tmp_path / "d.png", WOOD, GOLD)
    found = made(diffuse, halves(tmp_path / "s.png", reflected, BLACK))
    assert found.reflected is None and found.maps["color"] == diffuse and "metalness" not in found.maps
    assert (found.color, found.metalness) == ((1.0, 0.5, 0.5), 0.0)


@pytest.mark.parametrize("right", [PLASTIC, GOLD])
def test_a_picture_without_alpha_is_as_smooth_as_its_factor(tmp_path: Path, right: tuple[float, ...]) -> None:
    diffuse = halves(tmp_path / "d.png", WOOD, WOOD, alpha=False)
    found = made(diffuse, halves(tmp_path / "s.png", PLASTIC, right, alpha=False))
    assert ("metalness" in found.maps) == (right is GOLD)
    assert found.roughness == pytest.approx(0.25) and "smoothness" not in found.maps
    if right is GOLD:
        assert np.abs(linear(found.maps["color"], tmp_path)[:, 12] - GOLD).max() < 0.01


@pytest.mark.parametrize("alpha", [False, True])
def test_a_grey_picture_is_read_as_one_of_colours(tmp_path: Path, alpha: bool) -> None:
    """Also where silver is a single spot: the rest of the surface is none."""
    grey = np.zeros((16, 16, 1 + alpha), np.uint8)
    grey[5, 3], grey[..., 1:] = 255, 90
    (tmp_path / "s.png").write_bytes(encode_png(grey))
    found = made(None, MapSource(Picture(tmp_path / "s.png", name="s.png"), srgb=True))
    assert ("smoothness" in found.maps) == alpha
    assert found.maps["metalness"].channel == "r" and not found.maps["metalness"].srgb
    metal, color = (linear(found.maps[role], tmp_path) for role in ("metalness", "color"))
    assert metal[5, 3, 0] == 1.0 and metal.sum() == 1.0 and np.array_equal(color[5, 3], WHITE)


def test_a_picture_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "s.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    broken = MapSource(Picture(tmp_path / "s.png", name="s.png"), srgb=True)
    with pytest.raises(SourceError, match=r"s\.png"):
        made(None, broken)
