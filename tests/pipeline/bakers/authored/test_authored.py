"""Drawn maps: what a picture of normals, gloss, heights or occlusion says is what its textures hold."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import PIL.Image
import pytest

from paradize.bakers.authored.bake import bake_authored
from paradize.bakers.color import bake_color
from paradize.bakers.cubemap import bake_cubemap
from paradize.bakers.maps.bake import bake_maps
from paradize.bakers.product import MapProduct
from paradize.bakers.registry import BAKERS
from paradize.errors import ParadizeError, SourceError
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.map_table import AUTHORED
from paradize.metrics.texels import decode_texels, rebuilt
from paradize.stages import authored, mips
from tests.pipeline import map_truth as truth
from tests.pipeline.heights import angles_between, save
from tests.pipeline.layouts import cards, rect
from tests.pipeline.stages.test_authored import flipped, hills
from tests.places import PEAK

KIND = {"uint8": oiio.UINT8, "uint16": oiio.UINT16, "float32": oiio.FLOAT}
Bake = dict[str, MapProduct]


def write(path: Path, values: np.ndarray) -> Path:
    """A picture (h, w) or (h, w, c) of uint8, uint16 or float32."""
    texels = values if values.ndim == 3 else values[:, :, None]
    return save(path, texels, KIND[texels.dtype.name])


def codes(normals: np.ndarray, top: int = 255) -> np.ndarray:
    """Unit vectors as glTF's codes."""
    found = np.rint((normals.astype(np.float64) * 0.5 + 0.5) * top)
    return found.astype(np.uint8 if top == 255 else np.uint16)


def noise(rows: int, columns: int, seed: int = 4) -> np.ndarray:
    """Smooth codes (h, w) uint8 of 20 to 235."""
    field = hills(rows, columns, seed)[:, :, 0].astype(np.float64)
    return np.rint(20 + 215 * (field - field.min()) / np.ptp(field)).astype(np.uint8)


def level(made: MapProduct, k: int = 0) -> np.ndarray:
    """The values that a sampler reads of a level, (h, w, c)."""
    return decode_texels(decode_ktx2(made.data), k).astype(np.float64)


TURN = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)[:, None].repeat(32, axis=1)
OBJECT_SPACE = np.stack([np.sin(TURN), 0 * TURN, np.cos(TURN)], axis=2)  # of a cylinder


@pytest.fixture
def normal(tmp_path: Path) -> Path:
    return write(tmp_path / "n.png", codes(hills(64, 96)))


# Normals.


@pytest.mark.parametrize("top", [255, 65535])
@pytest.mark.parametrize("down", [False, True])
def test_a_normal_map_keeps_its_normals_green_up(tmp_path: Path, top: int, down: bool) -> None:
    normals = hills(64, 96)
    path = write(tmp_path / "n.png", codes(flipped(normals) if down else normals, top))
    made = bake_authored({"normal": path}, green_down=down, uncompressed=True)["normal"]
    assert made.format == "RG16_SNORM" and not made.warnings
    assert angles_between(rebuilt(level(made)), normals).max() < (0.6 if top == 255 else 0.01)
    assert made.errors["normal_max_deg"] < 0.01


def test_green_that_points_down_is_turned_up_and_said(tmp_path: Path) -> None:
    path = write(tmp_path / "n.png", codes(flipped(hills(64, 96))))
    made = bake_authored({"normal": path})["normal"]
    said = bake_authored({"normal": path}, green_down=True)["normal"]
    assert made.data == said.data and not said.warnings
    (warning,) = made.warnings
    assert str(path) in warning and "green seems to point down" in warning


def test_a_direction_of_green_that_the_slopes_contradict_is_kept_and_said(normal: Path) -> None:
    made = bake_authored({"normal": normal}, green_down=True)["normal"]
    (warning,) = made.warnings
    assert "only if it points up" in warning
    assert angles_between(rebuilt(level(made)), flipped(hills(64, 96))).mean() < 2


def test_the_scale_of_normals_makes_them_as_steep_as_gltf_says(normal: Path) -> None:
    steep = hills(64, 96).astype(np.float64) * [2.5, 2.5, 1.0]
    steep /= np.linalg.norm(steep, axis=2, keepdims=True)
    made = bake_authored({"normal": normal}, normal_scale=2.5, uncompressed=True)["normal"]
    assert angles_between(rebuilt(level(made)), steep).max() < 1.5


def test_floats_alpha_and_profiles_of_colour_change_nothing(tmp_path: Path) -> None:
    normals = codes(hills(64, 96))
    made = bake_authored({"normal": write(tmp_path / "n.png", normals)})["normal"]
    rough = np.random.default_rng(1).integers(0, 256, (64, 96, 1), np.uint8)
    beside = write(tmp_path / "a.png", np.concatenate([normals, rough], axis=2))
    shares = write(tmp_path / "f.exr", (normals.astype(np.float64) / 255).astype(np.float32))
    assert bake_authored({"normal": beside})["normal"].data == made.data
    floats = bake_authored({"normal": shares}, uncompressed=True)["normal"]
    exact = bake_authored({"normal": tmp_path / "n.png"}, uncompressed=True)["normal"]
    assert angles_between(rebuilt(level(floats)), rebuilt(level(exact))).max() < 0.4
    signed = bake_authored({"normal": write(tmp_path / "s.exr", hills(64, 96))}, uncompressed=True)["normal"]
    assert angles_between(rebuilt(level(signed)), hills(64, 96)).max() < 0.01


def test_a_map_of_red_and_green_alone_gets_its_z_back(tmp_path: Path) -> None:
    two = codes(hills(64, 96))
    two[:, :, 2] = 0
    made = bake_authored({"normal": write(tmp_path / "n.png", two)}, uncompressed=True)["normal"]
    assert angles_between(rebuilt(level(made)), hills(64, 96)).max() < 1.0


@pytest.mark.parametrize(
    ("texels", "words"),
    [
        (np.full((8, 8, 3), 90, np.uint8), "are grey"),
        (np.full((8, 8), 90, np.uint8), "is grey"),
        (np.tile(np.uint8([200, 120, 40]), (8, 8, 1)), "point into the surface"),
        (codes(OBJECT_SPACE), "point into the surface"),
        (np.dstack([noise(32, 32, k) // 2 + 60 * (k == 2) for k in range(3)]), "point into the surface"),
        (np.zeros((8, 8, 3), np.uint8), "every texel is black"),
        (np.full((8, 8, 3), np.nan, np.float32), "nan"),
    ],
)
def test_what_is_no_normal_map_is_refused_by_name(tmp_path: Path, texels: np.ndarray, words: str) -> None:
    path = write(tmp_path / ("n.exr" if texels.dtype == np.float32 else "n.png"), texels)
    with pytest.raises(SourceError, match=words) as found:
        bake_authored({"normal": path})
    assert found.value.file == str(path) and found.value.mend


def test_vectors_that_are_not_unit_are_made_unit_and_said(tmp_path: Path) -> None:
    normals = hills(64, 96)
    short = codes(normals * np.float32(0.6))
    made = bake_authored({"normal": write(tmp_path / "n.png", short)}, uncompressed=True)["normal"]
    (warning,) = made.warnings
    assert "100 % of its normals" in warning and "made unit" in warning
    assert angles_between(rebuilt(level(made)), normals).max() < 1.0


def test_normals_into_the_surface_are_laid_flat_and_said(tmp_path: Path) -> None:
    texels = codes(hills(64, 96))
    texels[:2] = (255, 128, 60)
    made = bake_authored({"normal": write(tmp_path / "n.png", texels)}, uncompressed=True)["normal"]
    assert any("point into the surface" in text for text in made.warnings)
    assert angles_between(rebuilt(level(made))[:2], np.tile([1.0, 0, 0], (2, 96, 1))).max() < 0.5
    assert made.errors["normal_max_deg"] < 0.5


def test_short_normals_that_point_inwards_here_and_there_are_refused_where_they_lean(
    tmp_path: Path,
) -> None:
    texels = codes(hills(64, 96) * np.float32(0.6))
    texels[::10, :, 2] = 100
    made = bake_authored({"normal": write(tmp_path / "n.png", texels)}, measure=False)["normal"]
    assert any("point into the surface" in text for text in made.warnings)
    texels[:, :, 0] += 40  # as the colours of a photograph do
    with pytest.raises(SourceError, match="is not a normal map"):
        bake_authored({"normal": write(tmp_path / "n.png", texels)})


def test_mips_of_normals_are_means_of_vectors_made_unit(normal: Path) -> None:
    made = bake_authored({"normal": normal}, uncompressed=True)["normal"]
    exact = authored.decoded_normals(codes(hills(64, 96)), authored.NormalCoding())
    for k in range(1, len(made.levels)):
        wanted = truth.normalised(truth.mean(exact.astype(np.float64), k))
        assert angles_between(rebuilt(level(made, k)), wanted).max() < 0.01


def test_opposite_normals_cancel_into_a_flat_mip_and_the_roughest_gloss(tmp_path: Path) -> None:
    chess = (np.indices((8, 8)).sum(axis=0) % 2 * 255).astype(np.uint8)
    texels = np.dstack([chess, np.full((8, 8), 128, np.uint8), np.full((8, 8), 128, np.uint8)])
    rough = write(tmp_path / "r.png", np.tile(np.uint8([10, 30]), (8, 4)))
    sources = {"normal": write(tmp_path / "n.png", texels), "roughness": rough}
    made = bake_authored(sources, uncompressed=True)
    assert np.abs(level(made["normal"], 1)[:, :, :2]).max() == 0.0
    assert level(made["gloss"])[:, :, 1].min() > 0.85 and level(made["gloss"], 1)[:, :, 1].max() < 1e-4


# Gloss, height, occlusion.


def test_gloss_is_specular_and_one_minus_roughness_with_their_factors(tmp_path: Path) -> None:
    rough, specular = noise(32, 48), noise(32, 48, 9)
    sources = {"roughness": write(tmp_path / "r.png", rough), "specular": write(tmp_path / "s.png", specular)}
    made = bake_authored(sources, roughness=0.75, specular=0.5, uncompressed=True)["gloss"]
    wanted = np.dstack([specular / 255.0 * 0.5, 1.0 - 0.75 * rough / 255.0])
    assert np.abs(level(made) - wanted).max() < 1e-5
    assert made.errors["gloss_psnr_db"] > 90


def test_floats_beyond_one_are_one_for_the_map_and_for_what_measures_it(tmp_path: Path) -> None:
    """The error of gloss was the number of the file, up to more than a manifest holds."""
    specular = np.where(np.arange(64) % 2, np.float32(1e37), np.float32(0.25)).reshape(8, 8)
    made = bake_authored({"specular": write(tmp_path / "s.exr", specular)}, uncompressed=True)["gloss"]
    assert made.errors["gloss_max"] < 0.01 and "runs from 0.25 to 1e+37" in made.warnings[0]


def test_smoothness_is_inverted_roughness_and_an_inverted_role_counts_as_one_minus_it(tmp_path: Path) -> None:
    rough = noise(32, 48)
    r, s = write(tmp_path / "r.png", rough), write(tmp_path / "s.png", 255 - rough)
    wanted = bake_authored({"roughness": r}, roughness=0.5)["gloss"]
    assert bake_authored({"smoothness": s}, roughness=0.5)["gloss"].data == wanted.data
    assert bake_authored({"roughness": s}, roughness=0.5, inverted=["roughness"])["gloss"].data == wanted.data
    assert (
        bake_authored({"smoothness": r}, roughness=0.5, inverted=["smoothness"])["gloss"].data == wanted.data
    )


def test_gloss_mips_are_rougher_by_what_the_mips_of_the_normals_lose(tmp_path: Path) -> None:
    normals = hills(64, 64, steep=3.0)
    rough = noise(64, 64)
    n, r = write(tmp_path / "n.png", codes(normals)), write(tmp_path / "r.png", rough)
    alone = bake_authored({"roughness": r}, uncompressed=True)["gloss"]
    beside = bake_authored({"normal": n, "roughness": r}, only=["gloss"], uncompressed=True)
    assert set(beside) == {"gloss"}
    exact = authored.decoded_normals(codes(normals), authored.NormalCoding()).astype(np.float64)
    squared = (1.0 - (1.0 - rough / 255.0)[:, :, None]) ** 4
    for k in range(4):
        lost = np.linalg.norm(truth.mean(exact, k), axis=2)[:, :, None]
        wider = 2 * np.maximum(0, 1 - lost**2) / (lost * (3 - lost**2)) if k else 0.0
        total = truth.mean(squared, k)
        assert np.abs(level(alone, k)[:, :, 1:] - (1 - total**0.25)).max() < 1e-4
        wanted = 1 - np.minimum(1.0, total + wider) ** 0.25
        assert np.abs(level(beside["gloss"], k)[:, :, 1:] - wanted).max() < 1e-3
    assert (level(beside["gloss"], 4)[:, :, 1] < level(alone, 4)[:, :, 1] - 0.01).all()


@pytest.mark.parametrize("size", [(16, 16), (64, 128), (32, 20)])
def test_normals_of_another_size_make_gloss_rougher_too(tmp_path: Path, size: tuple[int, int]) -> None:
    n = write(tmp_path / "n.png", codes(hills(*size, steep=3.0)))
    r = write(tmp_path / "r.png", noise(32, 32))
    made = bake_authored({"normal": n, "roughness": r}, uncompressed=True)
    assert (made["normal"].height, made["normal"].width) == size
    assert (made["gloss"].height, made["gloss"].width) == (32, 32)
    assert (
        made["gloss"].levels[0]["psnr_db"] > 90 and min(one["psnr_db"] for one in made["gloss"].levels) > 60
    )
    alone = bake_authored({"roughness": r}, uncompressed=True)["gloss"]
    assert (level(made["gloss"], 2)[:, :, 1] < level(alone, 2)[:, :, 1]).mean() > 0.9


def test_occlusion_stands_beside_metalness_and_alone_in_one_channel(tmp_path: Path) -> None:
    hidden, metal = noise(32, 48), noise(32, 48, 9)
    packed = write(tmp_path / "orm.png", np.dstack([hidden, np.zeros_like(hidden), metal]))
    sources, channels = {"occlusion": packed, "metalness": packed}, {"occlusion": "r", "metalness": "b"}
    both = bake_authored(sources, channels=channels, metalness=0.5, uncompressed=True)["occlusion"]
    assert both.format == "RG16_UNORM"
    assert np.abs(level(both) - np.dstack([hidden / 255.0, 0.5 * metal / 255.0])).max() < 1e-5
    one = bake_authored({"occlusion": packed}, channels=channels, occlusion_strength=0.25)["occlusion"]
    assert one.format == "BC4_UNORM" and one.errors["occlusion_psnr_db"] > 40
    assert np.abs(level(one)[:, :, 0] - (1 + 0.25 * (hidden / 255.0 - 1))).max() < 0.02


def test_heights_that_leave_0_to_1_are_kept_whole_and_said(tmp_path: Path) -> None:
    field = (noise(16, 16) / 255.0 * 3 - 1).astype(np.float32)
    made = bake_authored({"height": write(tmp_path / "h.exr", field)}, uncompressed=True)["height"]
    wanted = (field - field.min()) / np.ptp(field)
    assert np.abs(level(made)[:, :, 0] - wanted).max() < 1e-4
    assert any("heights run from" in text for text in made.warnings)
    turned = bake_authored({"height": tmp_path / "h.exr"}, inverted=["height"], uncompressed=True)["height"]
    assert np.abs(level(turned)[:, :, 0] - (1 - wanted)).max() < 1e-4
    assert turned.errors["height_psnr_db"] > 90


def test_warnings_of_readers_reach_maps_alpha_and_skies(tmp_path: Path) -> None:
    turned = PIL.Image.Exif()
    turned[0x112] = 3
    path = tmp_path / "a.png"
    PIL.Image.fromarray(codes(hills(16, 16))).save(path, exif=turned)
    white = write(tmp_path / "white.png", np.full((16, 16), 255, np.uint8))
    roles = ("normal", "specular", "roughness", "height", "occlusion")
    made = bake_authored(dict.fromkeys(roles, path), green_down=False)
    products = [*made.values(), bake_color(white, alpha=path), bake_cubemap([path, *5 * [white]])]
    assert [sum("orientation 3" in text for text in each.warnings) for each in products] == 6 * [1]
    assert [text for text in products[-1].warnings if "bits" in text] == [
        f"{path}: 8 bits per channel: a sky shows bands (5 more faces too)"
    ]


def test_a_number_that_is_read_of_colours_is_told(tmp_path: Path) -> None:
    """As the roughness of a picture that holds occlusion, roughness and metalness."""
    rough = noise(16, 16)
    packed = write(tmp_path / "orm.png", np.stack([255 - rough, rough, 0 * rough], axis=2))
    grey = write(tmp_path / "grey.png", np.stack([rough, rough + 3, rough], axis=2))
    flat = write(tmp_path / "flat.png", np.full((16, 16, 3), (130, 128, 127), np.uint8))
    for role in ("roughness", "metalness", "occlusion", "height", "specular"):
        for path, channel in ((packed, "luminance"), (packed, "g"), (grey, "luminance"), (flat, "luminance")):
            (made,) = bake_authored({role: path}, channels={role: channel}, measure=False).values()
            told = path is packed and channel == "luminance" and role != "specular"
            assert any(f"luminance is read as {role}" in text for text in made.warnings) == told
    for path in (packed, grey):
        made = bake_maps(path, only=("normal",), source="height", measure=False)["normal"]
        assert any("luminance is read as heights" in text for text in made.warnings) == (path is packed)


def test_the_smaller_picture_of_a_map_is_enlarged_and_said(tmp_path: Path) -> None:
    rough = noise(16, 16)
    sources = {
        "roughness": write(tmp_path / "r.png", rough),
        "specular": write(tmp_path / "s.png", noise(64, 32)),
    }
    made = bake_authored(sources, uncompressed=True, wrap="repeat")["gloss"]
    assert (made.height, made.width) == (64, 32) and made.errors["gloss_psnr_db"] > 90
    assert any("16 x 16 texels are enlarged to 32 x 64" in text for text in made.warnings)
    means = level(made)[:, :, 1].reshape(16, 4, 16, 2).mean(axis=(1, 3))
    assert np.abs(means - (1 - rough / 255.0)).mean() < 0.02


@pytest.mark.parametrize("name", AUTHORED)
def test_a_map_whose_texels_are_equal_is_a_constant_and_no_texture(tmp_path: Path, name: str) -> None:
    flat = np.tile(np.uint8([128, 127, 255]), (16, 16, 1))
    grey = write(tmp_path / "g.png", np.full((16, 16), 51, np.uint8))
    white = write(tmp_path / "w.png", np.full((16, 16), 255, np.uint8))
    sources = {
        "normal": {"normal": write(tmp_path / "n.png", flat)},
        "height": {"height": grey},
        "gloss": {"roughness": grey},
        "occlusion": {"occlusion": white, "metalness": grey},
    }[name]
    made = bake_authored(sources, roughness=0.5, specular=0.25)[name]
    wanted = {"normal": (0, 0, 1), "height": (0.2,), "gloss": (0.25, 0.9), "occlusion": (1, 0.2)}[name]
    assert made.data == b"" and made.constant == pytest.approx(wanted, abs=1e-6)
    (product,) = BAKERS["authored"][1](sources, {}, "fast")
    assert product.artifact.constant is not None and product.data == b""


def test_a_tilted_normal_map_is_a_texture_since_no_factor_tilts(tmp_path: Path) -> None:
    tilted = write(tmp_path / "n.png", np.tile(np.uint8([200, 128, 230]), (4, 4, 1)))
    assert bake_authored({"normal": tilted})["normal"].constant is None


@pytest.mark.parametrize("metal", [False, True])
@pytest.mark.parametrize("tier", ["fast", "balanced"])
def test_occlusion_of_one_grey_is_a_texture_of_one_texel_since_no_factor_darkens(
    tmp_path: Path, metal: bool, tier: str
) -> None:
    grey = write(tmp_path / "g.png", np.full((16, 32), 51, np.uint8))
    sources = {"occlusion": grey} | ({"metalness": grey} if metal else {})
    made = bake_authored(sources, tier=tier, occlusion_strength=0.5)["occlusion"]
    assert made.constant is None and (made.width, made.height) == (1, 1)
    assert level(made)[0, 0, : 1 + metal] == pytest.approx([0.6, 0.2][: 1 + metal], abs=0.5 / 255)
    assert made.errors["occlusion_psnr_db"] > 50


def test_emission_is_a_colour_without_alpha_and_a_constant_where_it_is_one(tmp_path: Path) -> None:
    glow = np.dstack([noise(16, 16), noise(16, 16, 2), noise(16, 16, 3), noise(16, 16, 5)])
    made = bake_color(write(tmp_path / "e.png", glow), product="emission")
    plain = bake_color(write(tmp_path / "c.png", glow[:, :, :3].copy()))
    assert made.data == plain.data and made.metric == "emission_psnr_db"
    one = bake_color(write(tmp_path / "b.png", np.full((4, 4, 3), 188, np.uint8)), product="emission")
    assert one.data == b"" and one.constant == pytest.approx([((188 / 255 + 0.055) / 1.055) ** 2.4] * 3)
    bright = bake_color(write(tmp_path / "b.exr", np.full((4, 4, 3), 1e30, np.float32)), product="emission")
    assert bright.constant == (1.0, 1.0, 1.0) and "holds 0..1" in bright.warnings[0]


# Layouts, settings, bytes.


def test_gutters_take_the_nearest_texel_inside_whatever_lies_around(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(cards([rect(4, 4, 28, 60), rect(36, 4, 60, 60)]))
    (tmp_path / "post.mtl").write_text("newmtl wood\n")
    normals, rough = codes(hills(64, 64)), noise(64, 64)
    inside = np.zeros((64, 64), np.bool_)
    inside[3:61, 3:29] = inside[3:61, 35:61] = True
    made = []
    for k, around in enumerate([0, 90]):
        normals[~inside], rough[~inside] = around, around
        sources = {
            "normal": write(tmp_path / f"n{k}.png", normals),
            "roughness": write(tmp_path / f"r{k}.png", rough),
        }
        made.append(bake_authored(sources, uv=tmp_path / "m.obj"))
    for name in ("normal", "gloss"):
        assert made[0][name].data == made[1][name].data
        assert all(made[0][name].levels)
    assert not made[0]["normal"].warnings


def test_what_is_only_around_the_islands_does_not_make_a_map_vary(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(cards([rect(4, 4, 60, 60)]))
    (tmp_path / "post.mtl").write_text("newmtl wood\n")
    rough = np.full((64, 64), 40, np.uint8)
    rough[:2] = 200
    made = bake_authored({"roughness": write(tmp_path / "r.png", rough)}, uv=tmp_path / "m.obj")
    assert made["gloss"].constant == pytest.approx((1.0, 1 - 40 / 255))


@pytest.mark.parametrize(
    ("sources", "changes", "words"),
    [
        (["normal"], {"only": ["colour"]}, "no map 'colour'"),
        (["shine"], {}, "no role 'shine'"),
        (["normal"], {"tier": "slow"}, "no tier 'slow'"),
        (["normal"], {"normal_scale": float("nan")}, "scale of normals is nan"),
        (["roughness"], {"roughness": 1.5}, "roughness is 1.5; 0 to 1"),
        (["roughness", "smoothness"], {}, "a roughness and a smoothness"),
        (["roughness"], {"channels": {"roughness": "x"}}, "no channel 'x'"),
        (["roughness"], {"channels": {"roughness": "a"}}, "has no alpha, where roughness"),
        (["roughness"], {"wrap": "mirror"}, "no wrap 'mirror'"),
    ],
)
def test_settings_that_cannot_be_met_are_refused_by_name(
    normal: Path, sources: list[str], changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(ParadizeError, match=words):
        bake_authored(dict.fromkeys(sources, normal), **changes)


@pytest.mark.parametrize("shape", [(1, 1), (1, 37), (5, 3), (64, 1)])
@pytest.mark.parametrize("wrap", ["clamp", "repeat"])
def test_maps_of_any_shape_are_baked(tmp_path: Path, shape: tuple[int, int], wrap: str) -> None:
    rng = np.random.default_rng(8)
    normals = hills(8, 40)[: shape[0], : shape[1]] if shape[0] < 9 else hills(64, 8)[:, :1]
    paths = {
        "normal": write(tmp_path / "n.png", codes(normals)),
        "roughness": write(tmp_path / "r.png", rng.integers(0, 256, shape, np.uint8)),
        "occlusion": write(tmp_path / "o.png", rng.integers(0, 65536, shape, np.uint16)),
    }
    for name, made in bake_authored(paths, wrap=wrap, tier="exact").items():
        assert (made.height, made.width) == normals.shape[:2], name
        assert (made.constant is None) == bool(made.levels)
        assert all(np.isfinite(value) for one in made.levels for value in one.values())


def test_a_budget_takes_a_more_exact_format_and_says_why(normal: Path) -> None:
    made = bake_authored({"normal": normal}, budget={"normal_p99_deg": 0.01})["normal"]
    assert made.format == "RG16_SNORM" and made.reason and "RG8_SNORM exceeds" in made.reason


def test_tiers_err_no_more_from_one_to_the_next(tmp_path: Path, normal: Path) -> None:
    sources = {"normal": normal, "roughness": write(tmp_path / "r.png", noise(64, 96))}
    errors = [bake_authored(sources, tier=tier) for tier in ("fast", "balanced", "exact")]
    degrees = [one["normal"].errors["normal_mean_deg"] for one in errors]
    decibels = [one["gloss"].errors["gloss_psnr_db"] for one in errors]
    assert degrees == sorted(degrees, reverse=True) and decibels == sorted(decibels)


def test_any_number_of_threads_makes_the_same_bytes_and_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path / "normal.png", codes(hills(260, 520)))
    for k, role in enumerate(("roughness", "occlusion", "metalness", "height")):
        write(tmp_path / f"{role}.png", noise(260, 520, k))
    write(tmp_path / "specular.png", noise(100, 90))
    roles = ("normal", "roughness", "specular", "occlusion", "metalness", "height")
    made = []
    for threads in ("1", "3"):
        monkeypatch.setenv("PARADIZE_THREADS", threads)
        maps = bake_authored({role: tmp_path / f"{role}.png" for role in roles}, wrap="repeat")
        made.append({name: (one.data, one.levels) for name, one in maps.items()})
    assert made[0] == made[1]


# Faults in a stage show in the errors, since no metric calls it.


@pytest.mark.parametrize("fault", ["green", "gloss", "widening"])
def test_a_fault_of_a_stage_shows_in_the_errors(
    tmp_path: Path, normal: Path, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    sources = {"normal": normal, "roughness": write(tmp_path / "r.png", noise(64, 96))}
    sound = bake_authored(sources, uncompressed=True)
    if fault == "green":
        decode = authored.decoded_normals
        monkeypatch.setattr("paradize.bakers.authored.rows.decoded_normals", lambda *a: flipped(decode(*a)))
    elif fault == "gloss":
        shares = authored.shares
        monkeypatch.setattr(
            "paradize.bakers.authored.rows.shares", lambda *a, **k: shares(*a, **k) * np.float32(0.95)
        )
    else:
        monkeypatch.setattr(
            "paradize.bakers.authored.textures.gloss_rows",
            lambda bundle, level: (
                mips.gloss_rows(bundle, 0 * level)
                if level == 0
                else np.concatenate([bundle["specular"], 1 - np.sqrt(np.sqrt(bundle["variance"]))], axis=2)
            ),
        )
    spoilt = bake_authored(sources, uncompressed=True)
    if fault == "green":
        assert spoilt["normal"].errors["normal_p99_deg"] > 5 > sound["normal"].errors["normal_p99_deg"]
    elif fault == "gloss":
        assert spoilt["gloss"].errors["gloss_psnr_db"] < 40 < sound["gloss"].errors["gloss_psnr_db"]
    else:
        assert spoilt["gloss"].levels[2]["psnr_db"] < 50 < sound["gloss"].levels[2]["psnr_db"]


MEMORY = (
    PEAK
    + """
import sys
from pathlib import Path
import paradize.kernels.bc7, paradize.metrics.levels
from paradize.bakers.authored.bake import bake_authored
from paradize.formats.ktx2.encode import encode_ktx2
before = peak() // 1024
folder = Path(sys.argv[1])
roles = ("normal", "roughness", "occlusion")
bake_authored({role: folder / f"{role}.png" for role in roles}, wrap="repeat")
print(peak() // 1024 - before)
"""
)


@pytest.mark.deep
def test_three_maps_need_at_most_as_much_memory_as_48_bytes_a_texel(tmp_path: Path) -> None:
    size = 2048
    write(tmp_path / "normal.png", np.tile(codes(hills(512, 512)), (4, 4, 1)))
    for k, role in enumerate(("roughness", "occlusion")):
        write(tmp_path / f"{role}.png", np.tile(noise(512, 512, k), (4, 4)))
    environment = {**os.environ, "PARADIZE_THREADS": "2"}
    command = [sys.executable, "-c", MEMORY, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) * 1024 <= 48 * size * size
