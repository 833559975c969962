"""`check` of authored maps: what is baked passes, a level of another picture is found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.authored.bake import bake_authored
from paradize.bakers.color import bake_color
from paradize.formats.ktx2.reader import decode_ktx2
from tests.pipeline.bakers.authored.test_authored import codes as normal_codes
from tests.pipeline.bakers.authored.test_authored import noise, write
from tests.pipeline.checks.test_maps import Files, codes, with_level
from tests.pipeline.heights import normals, waves
from tests.sweeps import sample


def drawn(folder: Path, seed: int = 3) -> Files:
    """Every map of a material whose normals and heights are of one surface."""
    field = waves(96, 128, seed, 10.0)
    field = (field - field.min()) / np.ptp(field)
    vectors = normals(field, scale=(6.0, 6.0), wrap=(True, True))
    metal = noise(96, 128, seed + 5)
    made = bake_authored(
        {
            "normal": write(folder / "n.png", normal_codes(vectors)),
            "height": write(folder / "h.png", np.rint(field * 65535).astype(np.uint16)),
            "roughness": write(folder / "r.png", noise(96, 128, seed + 1)),
            "occlusion": write(folder / "o.png", noise(96, 128, seed + 2)),
            "metalness": write(folder / "m.png", metal),
        },
        wrap="repeat",
    )
    glow = write(folder / "e.png", np.dstack([noise(96, 128, seed + k) for k in (7, 8, 9)]))
    made["emission"] = bake_color(glow, product="emission", wrap="repeat")
    return {kind: decode_ktx2(one.data) for kind, one in made.items()}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "maps").mkdir()
    return tmp_path / "maps"


@pytest.mark.parametrize("seed", sample([3, 11], every=2))
def test_drawn_maps_of_one_surface_pass(tmp_path: Path, folder: Path, seed: int) -> None:
    assert codes(folder, drawn(tmp_path, seed)) == []


@pytest.mark.parametrize("kind", ["emission", "occlusion", "gloss", "height"])
def test_a_level_of_another_drawn_map_is_found(tmp_path: Path, folder: Path, kind: str) -> None:
    one = drawn(tmp_path)[kind]
    flat = bytes(len(one.levels[2]))
    assert codes(folder, {kind: with_level(one, 2, flat)}) == ["PZ213"]


def test_metalness_of_a_level_counts_too(tmp_path: Path, folder: Path) -> None:
    occlusion = drawn(tmp_path)["occlusion"]
    assert occlusion.format == "BC5_UNORM"
    blocks = np.frombuffer(occlusion.levels[1], np.uint8).reshape(-1, 16).copy()
    blocks[:, 8:] = 0
    assert codes(folder, {"occlusion": with_level(occlusion, 1, blocks.tobytes())}) == ["PZ213"]


def test_drawn_normals_of_another_surface_than_the_heights_are_found(tmp_path: Path, folder: Path) -> None:
    one, other = drawn(tmp_path), drawn(tmp_path, 11)
    assert codes(folder, {"normal": other["normal"], "height": one["height"]}) == ["PZ215"]
