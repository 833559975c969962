"""`check` finds maps that do not belong together, and lets those that a bake makes pass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.bakers.color import bake_color
from paradize.bakers.maps.bake import bake_maps
from paradize.checks import check_paths
from paradize.checks.maps import Map, check_maps
from paradize.checks.rules import RULES
from paradize.data import Texture
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.texels import decode_texels
from tests.pipeline.heights import save, waves
from tests.sweeps import sample

Files = dict[str, Texture]
Plant = Callable[[Files, Path], Files]  # of the maps of a picture


def hills(folder: Path, seed: int = 3) -> Path:
    heights = waves(96, 128, seed, 10.0)
    heights = (heights - heights.min()) / np.ptp(heights)
    return save(folder / f"hills{seed}.png", heights[:, :, None], oiio.UINT16)


def maps_of(path: Path, strength: float = 4.0, green: str = "up", wrap: str = "repeat") -> Files:
    made = bake_maps(path, source="height", strength=strength, wrap=wrap, green=green, measure=False)
    return {kind: decode_ktx2(product.data) for kind, product in made.items()}


def codes(folder: Path, files: Files) -> list[str]:
    for kind, texture in files.items():
        (folder / f"hills_{kind}.ktx2").write_bytes(encode_ktx2(texture))
    return [finding.code for finding in check_paths([folder])]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "maps").mkdir()
    return tmp_path / "maps"


@pytest.fixture
def files(tmp_path: Path) -> Files:
    return maps_of(hills(tmp_path))


def with_level(texture: Texture, level: int, data: bytes) -> Texture:
    return replace(texture, levels=(*texture.levels[:level], data, *texture.levels[level + 1 :]))


@pytest.mark.parametrize("strength", sample([0.0, 0.5, 4.0, 60.0], every=2))
@pytest.mark.parametrize("green", ["up", "down"])
def test_maps_of_one_bake_pass(tmp_path: Path, folder: Path, strength: float, green: str) -> None:
    assert codes(folder, maps_of(hills(tmp_path), strength, green)) == []


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (37, 53), (64, 4)])
def test_maps_of_any_size_pass(tmp_path: Path, folder: Path, shape: tuple[int, int]) -> None:
    noise = np.random.default_rng(1).random((*shape, 1))
    assert codes(folder, maps_of(save(tmp_path / "noise.png", noise, oiio.UINT16))) == []


def test_maps_of_a_slope_pass_and_its_offsets_add_up_to_nothing(tmp_path: Path, folder: Path) -> None:
    """Its normals lean to one side on the whole, which du/dv leave out."""
    heights = waves(64, 64, 3, 10.0)
    heights = 0.2 * (heights - heights.min()) / np.ptp(heights) + 0.8 * np.arange(64) / 63.0
    slope = maps_of(
        save(tmp_path / "slope.png", heights[:, :, None], oiio.UINT16), strength=40.0, wrap="clamp"
    )
    lean = decode_texels(slope["normal"])[:, :, 0].mean()
    assert abs(lean) > 0.2
    assert codes(folder, slope) == []


def test_normals_that_are_green_down_are_found_where_they_must_be_up(tmp_path: Path) -> None:
    """Files alone do not say which way green is; a scene's maps are green up."""
    for green, found in (("up", []), ("down", ["PZ215"])):
        files = maps_of(hills(tmp_path), green=green)
        maps = {kind: Map(f"{kind}.ktx2", files[kind]) for kind in ("normal", "height")}
        assert [finding.code for finding in check_maps(maps, green_up=True)] == found
        assert list(check_maps(maps)) == []


def one_code_more(level: int) -> Plant:
    def plant(files: Files, picture: Path) -> Files:
        data = bytearray(files["dudv"].levels[level])
        data[1] ^= 1
        return files | {"dudv": with_level(files["dudv"], level, bytes(data))}

    return plant


def dudv_of(make: Callable[[Path], Files]) -> Plant:
    return lambda files, picture: files | {"dudv": make(picture)["dudv"]}


def other_level(kind: str, level: int) -> Plant:
    def plant(files: Files, picture: Path) -> Files:
        other = maps_of(hills(picture.parent, seed=4))[kind]
        return {kind: with_level(files[kind], level, other.levels[level])}

    return plant


def upside_down_levels(files: Files, picture: Path) -> Files:
    down = maps_of(picture, green="down")["normal"]
    return {"normal": replace(down, levels=(files["normal"].levels[0], *down.levels[1:]))}


def calm_gloss(files: Files, picture: Path) -> Files:
    return {"normal": maps_of(picture, 40.0)["normal"], "gloss": maps_of(picture, 0.0)["gloss"]}


def other_normal(files: Files, picture: Path) -> Files:
    return {"normal": maps_of(hills(picture.parent, seed=4))["normal"], "height": files["height"]}


def inside_out(files: Files, picture: Path) -> Files:
    down = maps_of(picture, strength=-4.0)["normal"]
    return {"normal": down, "height": files["height"]}


MAP_FAULTS: list[tuple[str, str, Plant]] = [
    ("PZ211", "du/dv whose codes do not cancel out", one_code_more(0)),
    ("PZ211", "a level of du/dv whose codes do not cancel out", one_code_more(2)),
    ("PZ211", "a last level of du/dv that is not 0", one_code_more(7)),
    ("PZ212", "du/dv of twice the height", dudv_of(lambda path: maps_of(path, strength=8.0))),
    ("PZ212", "du/dv with green down", dudv_of(lambda path: maps_of(path, green="down"))),
    ("PZ212", "du/dv of another picture", dudv_of(lambda path: maps_of(hills(path.parent, seed=4)))),
    ("PZ213", "a level of another normal map", other_level("normal", 1)),
    ("PZ213", "a smaller level of another normal map", other_level("normal", 2)),
    ("PZ213", "a level of another height map", other_level("height", 1)),
    ("PZ213", "a smaller level of another height map", other_level("height", 2)),
    ("PZ213", "normals whose levels are upside down", upside_down_levels),
    ("PZ215", "normals of another picture", other_normal),
    ("PZ215", "normals of hollows for heights of hills", inside_out),
    ("PZ214", "gloss of calmer normals", calm_gloss),
]


@pytest.mark.parametrize(("code", "fault", "plant"), MAP_FAULTS, ids=[f for _, f, _ in MAP_FAULTS])
def test_the_rule_fires_and_no_other(
    tmp_path: Path, folder: Path, files: Files, code: str, fault: str, plant: Plant
) -> None:
    assert codes(folder, plant(files, hills(tmp_path))) == [code]


def test_colours_averaged_without_their_curve_are_found(folder: Path) -> None:
    """A chequerboard of black and white is a bright grey, not the middle of the codes."""
    board = np.indices((64, 64)).sum(axis=0) % 2 * 255

    def chain(grey: int) -> Texture:
        flat = [np.full((64 >> k, 64 >> k), grey) for k in range(1, 7)]
        planes = [np.repeat(level[:, :, None], 4, axis=2) for level in (board, *flat)]
        for plane in planes:
            plane[:, :, 3] = 255
        return Texture("RGBA8_SRGB", 64, 64, tuple(plane.astype(np.uint8).tobytes() for plane in planes))

    assert codes(folder, {"color": chain(188)}) == []
    assert codes(folder, {"color": chain(128)}) == ["PZ213"]


def test_a_palette_whose_small_levels_no_block_can_hold_passes(tmp_path: Path, folder: Path) -> None:
    """All colours of a block of BC1 lie on one line; a palette's small levels hold many hues in one."""
    hues = np.array([[230, 20, 20], [20, 200, 30], [20, 30, 220], [240, 230, 20]], np.uint8)
    cells = np.random.default_rng(5).integers(0, 4, (8, 8))

    def baked(colors: npt.NDArray[np.uint8]) -> Texture:
        board = colors[cells].repeat(16, axis=0).repeat(16, axis=1)
        return decode_ktx2(bake_color(save(tmp_path / "palette.png", board)).data)

    chain, other = baked(hues), baked(hues[::-1])
    assert chain.format == "BC1_RGB_SRGB"
    assert codes(folder, {"color": chain}) == []
    for level in (1, 2, 3):
        assert codes(folder, {"color": with_level(chain, level, other.levels[level])}) == ["PZ213"]


def test_greys_whose_smallest_levels_no_block_can_hold_pass(tmp_path: Path, folder: Path) -> None:
    """A block of BC1 or BC3 has four colours: those of bright texels beside dark ones are rounded far."""
    random = np.random.default_rng(48)
    light = np.where(
        random.random((4, 4)) < 0.3, 0.1 * random.random((4, 4)), 0.25 + 0.25 * random.random((4, 4))
    )
    shown = np.where(random.random((4, 4)) < 0.3, 0.0, random.random((4, 4)))
    shown[0, 0] = 1.0
    encoded = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)

    def baked(grey: npt.NDArray[np.float64]) -> Texture:
        cells = np.rint(np.dstack([grey, grey, grey, shown]) * 255.0).astype(np.uint8)
        path = save(tmp_path / "cells.png", cells.repeat(16, axis=0).repeat(16, axis=1))
        return decode_ktx2(bake_color(path).data)

    chain = baked(encoded)
    assert chain.format == "BC3_SRGB"
    assert codes(folder, {"color": chain}) == []
    other = baked(1.0 - encoded)
    assert codes(folder, {"color": with_level(chain, 4, other.levels[4])}) == ["PZ213"]


def test_dithered_colours_pass_and_their_bake_says_how_far_blocks_are_from_them(
    tmp_path: Path, folder: Path
) -> None:
    """Level 0 in blocks has another mean than the smaller levels, which was an error of a sound bake."""
    hues = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0]], np.uint8)
    path = save(tmp_path / "dithered.png", hues[np.random.default_rng(3).integers(0, 4, (64, 64))])
    made = bake_color(path)
    chain = decode_ktx2(made.data)
    assert chain.format == "BC1_RGB_SRGB" and codes(folder, {"color": chain}) == []
    (warning,) = made.warnings
    assert "BC1_RGB_SRGB keeps its colours at 10.3 dB alone" in warning
    kept = bake_color(path, budget={"color_psnr_db": 30.0})
    assert kept.errors["color_psnr_db"] > 30.0 and not kept.warnings
    turned = decode_ktx2(bake_color(save(tmp_path / "other.png", hues[::-1][np.zeros((64, 64), int)])).data)
    assert codes(folder, {"color": with_level(chain, 3, turned.levels[3])}) == ["PZ213"]


def test_gloss_of_rough_normals_passes_beside_them(tmp_path: Path, folder: Path) -> None:
    rough = maps_of(hills(tmp_path), strength=40.0)
    assert codes(folder, {kind: rough[kind] for kind in ("normal", "gloss")}) == []


def test_every_rule_here_tells_its_cause_and_its_mend() -> None:
    for code in ("PZ211", "PZ212", "PZ213", "PZ214"):
        rule = RULES[code]
        assert rule.severity == "error"
        assert rule.cause and rule.mend


def test_maps_that_cannot_be_read_are_told_once(folder: Path, files: Files) -> None:
    codes(folder, files)
    (folder / "hills_dudv.ktx2").write_bytes(b"nothing")
    assert [finding.code for finding in check_paths([folder])] == ["PZ102"]
