"""Two commands in a row from one source never contradict each other: `check` finds no fault in what another
command has just made."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from paradize.bakers.maps.bake import bake_maps
from paradize.checks.maps import Map, check_maps
from paradize.formats.ktx2.reader import decode_ktx2
from tests.pipeline.heights import save, waves
from tests.pipeline.layouts import cards, rect
from tests.sweeps import sweep

Run = Callable[..., subprocess.CompletedProcess[str]]


def palette_kit(folder: Path, seed: int, size: int = 256) -> tuple[Path, Path]:
    """A model as kits have them, and its texture: swatches of colour, plain, with gradients or with grain;
    small islands somewhere in them, so that nearly all of the map is gutter."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 17))
    colors = rng.integers(0, 256, (count, count, 3)).astype(float)
    side = -(-size // count)
    board = colors.repeat(side, axis=0).repeat(side, axis=1)[:size, :size]
    if seed % 3 == 1:
        board *= 1.0 - 0.6 * (np.arange(size) % side / side)[:, None, None]
    if seed % 3 == 2:
        board += rng.normal(0.0, rng.choice([1.0, 4.0, 12.0]), board.shape)
    islands = []
    for _ in range(int(rng.integers(4, 60))):
        left, top = rng.uniform(0, 0.9 * size, 2)
        width, height = rng.choice([0.01, 0.03, 0.1]) * size * rng.random(2)
        islands.append(rect(left, top, left + width, top + height))
    model = folder / f"kit{seed}.obj"
    model.write_text(cards(islands, size).replace("mtllib post.mtl\n", ""))
    return model, save(folder / f"kit{seed}.png", np.rint(board.clip(0, 255)).astype(np.uint8))


def finds_no_fault(paradize_here: Run, folder: Path) -> None:
    result = paradize_here("check", folder)
    assert result.returncode == 0, result.stdout + result.stderr


def makes(paradize_here: Run, *arguments: object) -> None:
    result = paradize_here(*arguments)
    assert result.returncode == 0, (arguments, result.stderr)


def follows_the_readme(paradize_here: Run, model: Path, texture: Path, out: Path, *options: object) -> None:
    """`mesh`, `maps --uv`, `check`."""
    makes(paradize_here, "mesh", model, "-o", out / "model.glb")
    makes(paradize_here, "maps", texture, "-o", out, "--uv", model, *options)
    finds_no_fault(paradize_here, out)


@pytest.mark.parametrize(
    ("form", "tier"), sweep([("ktx2", "balanced"), ("png", "fast")], test=[("ktx2", "balanced")])
)
def test_the_readmes_recipe_passes_its_own_check(
    paradize_here: Run, tmp_path: Path, form: str, tier: str
) -> None:
    model, texture = palette_kit(tmp_path, 1)
    follows_the_readme(paradize_here, model, texture, tmp_path / "out", "--format", form, "--tier", tier)


def corpus_kits(corpus: Path) -> list[tuple[Path, Path]]:
    """The models of the corpus that have textures, each with each."""
    found = []
    for model in sorted(corpus.glob("obj-*/**/*.obj")):
        libraries = re.findall(r"^mtllib\s+(.+?)\s*$", model.read_text(errors="replace"), re.M)
        materials = [model.parent / name for name in libraries if (model.parent / name).is_file()]
        names = {
            material.parent / name
            for material in materials
            for name in re.findall(r"^\s*map_Kd\s+(\S+)\s*$", material.read_text(errors="replace"), re.M)
        }
        found += [(model, name) for name in sorted(names) if name.is_file()]
    return found


@pytest.mark.deep
def test_the_readmes_recipe_passes_on_each_kit_of_others(
    paradize_here: Run, corpus: Path, tmp_path: Path
) -> None:
    """One model of every fourth texture."""
    firsts = {texture: model for model, texture in reversed(corpus_kits(corpus))}
    assert len(firsts) > 5
    for i, (texture, model) in enumerate(firsts.items()):
        if i % 4 == 0 and texture.stat().st_size < 1 << 17:
            follows_the_readme(paradize_here, model, texture, tmp_path / str(i), "--tier", "fast")


@pytest.mark.deep
@pytest.mark.parametrize("form", ["ktx2", "png"])
def test_the_readmes_recipe_passes_on_every_textured_model(
    paradize_here: Run, corpus: Path, tmp_path: Path, form: str
) -> None:
    kits = corpus_kits(corpus)
    assert len(kits) > 50
    for i, (model, texture) in enumerate(kits):
        tier = ("fast", "balanced", "exact")[i % 3]
        follows_the_readme(paradize_here, model, texture, tmp_path / str(i), "--format", form, "--tier", tier)


@pytest.mark.deep
def test_every_mesh_passes(paradize_here: Run, corpus: Path, tmp_path: Path) -> None:
    for i, model in enumerate(sorted(corpus.glob("obj-*/**/*.obj"))):
        if paradize_here("mesh", model, "-o", tmp_path / str(i) / "model.glb").returncode == 0:
            finds_no_fault(paradize_here, tmp_path / str(i))


def test_a_terrain_passes(paradize_here: Run, tmp_path: Path) -> None:
    heights = waves(65, 65, 1, 12.0)
    heights = (heights - heights.min()) / np.ptp(heights)
    picture = save(tmp_path / "hills.png", heights[:, :, None], oiio.UINT16)
    makes(
        paradize_here, "terrain", picture, "-o", tmp_path / "out/hills.glb", "--size", 100, 100, "--height", 9
    )
    finds_no_fault(paradize_here, tmp_path / "out")


def passes_as_a_scene(paradize_here: Run, model: Path, folder: Path) -> None:
    """`new --from`, `bake`, `check`."""
    makes(paradize_here, "new", folder / "scene", "--from", model)
    makes(paradize_here, "bake", folder / "scene/scene.toml", "-o", folder / "out")
    finds_no_fault(paradize_here, folder / "out")


@pytest.mark.deep
@pytest.mark.parametrize("kind", ["palette", "gradients and a drawing", "painted"])
def test_a_new_scene_of_a_kit_passes(
    paradize_here: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Nothing is warned of either: that faces share texels harms nothing where no occlusion lies on them."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    board = np.full((64, 64, 3), 90, np.uint8)
    board[:, 32:] = (200, 40, 40)
    if kind == "painted":
        board[20:24, 8:24] = 255
    elif kind != "palette":
        board[4:60] = 30 + 3 * np.arange(56, dtype=np.uint8)[:, None, None]
        board[4:8, 38:40] = 255
    shared = [rect(4, 4, 28, 60), rect(4, 4, 28, 60), rect(44, 4, 60, 60), rect(36, 4, 40, 8)]
    model = tmp_path / "kit.obj"
    model.write_text(cards(shared, 64).replace("post.mtl", "kit.mtl"))
    (tmp_path / "kit.mtl").write_text("newmtl wood\nmap_Kd kit.png\n")
    save(tmp_path / "kit.png", board)
    passes_as_a_scene(paradize_here, model, tmp_path)
    output = paradize_here("check", tmp_path / "out").stdout
    assert output.endswith(" artifacts checked: no finding\n")


@pytest.mark.deep
def test_new_scenes_of_the_corpus_pass(
    paradize_here: Run, corpus: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    for i, (model, _) in enumerate(corpus_kits(corpus)[::4]):
        passes_as_a_scene(paradize_here, model, tmp_path / str(i))


SEEDS = sweep(range(200), test=[0, 3])


@pytest.mark.parametrize("seed", SEEDS)
def test_maps_of_a_palette_pass_whatever_their_settings(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, texture = palette_kit(tmp_path, seed, int(rng.choice([32, 100, 128, 256])))
    green = str(rng.choice(["up", "down"]))
    made = bake_maps(
        texture,
        uv=model,
        tier=str(rng.choice(["fast", "balanced"])),
        strength=float((0.3, 1.0, 5.0, 30.0)[seed % 4]),
        green=green,
        wrap=str(rng.choice(["clamp", "repeat"])),
        measure=False,
    )
    maps = {kind: Map(kind, decode_ktx2(product.data)) for kind, product in made.items()}
    assert [str(finding) for finding in check_maps(maps, green_up=green == "up")] == []


def grain(seed: int) -> np.ndarray:
    rough = np.random.default_rng(seed).random((256, 256))
    return sum(np.roll(rough, (dy, dx), (0, 1)) for dy in range(3) for dx in range(3)) / 9.0


def baked(folder: Path, heights: np.ndarray, **settings: object) -> dict[str, Map]:
    """Maps of heights on a layout of four islands with wide gutters."""
    model = folder / "four.obj"
    corners = [(30.0, 30.0), (150.0, 20.0), (20.0, 140.0), (160.0, 150.0)]
    model.write_text(cards([rect(x, y, x + 70, y + 80) for x, y in corners], 256))
    picture = save(folder / "picture.png", heights[:, :, None], oiio.UINT16)
    made = bake_maps(picture, source="height", uv=model, tier="fast", measure=False, **settings)  # type: ignore[arg-type]
    return {kind: Map(kind, decode_ktx2(product.data)) for kind, product in made.items()}


def turned(found: Map) -> Map:
    """Normals whose x and y changed places."""
    xy = found.finest[:, :, 1::-1]
    codes = np.rint(xy * 127.0).astype(np.int8)
    level = Map(found.file, found.texture)
    level.__dict__["finest"] = codes.astype(np.float32) / 127.0
    return level


@pytest.mark.parametrize("fault", ["none", "other source", "green down", "swapped axes", "inside out"])
def test_steps_between_gutters_hide_no_fault_of_the_islands(tmp_path: Path, fault: str) -> None:
    """Each island at a height of its own, so that gutters meet in steps, and grain on it."""
    rows, columns = np.indices((256, 256)) // 128
    heights = 0.2 * (rows + 2 * columns) + 0.3 * grain(1)
    maps = baked(tmp_path, heights)
    normal = {
        "none": lambda: maps["normal"],
        "other source": lambda: baked(tmp_path, 0.2 * (rows + 2 * columns) + 0.3 * grain(2))["normal"],
        "green down": lambda: baked(tmp_path, heights, green="down")["normal"],
        "swapped axes": lambda: turned(maps["normal"]),
        "inside out": lambda: baked(tmp_path, heights, strength=-1.0)["normal"],
    }[fault]()
    pair = {"normal": normal, "height": maps["height"]}
    found = [finding.code for finding in check_maps(pair, green_up=True) if finding.code == "PZ215"]
    assert found == ([] if fault == "none" else ["PZ215"])


def test_du_dv_that_is_cut_off_at_one_is_its_normal_maps(tmp_path: Path) -> None:
    """Of a saw's teeth most texels lean to one side, and the others are farther than 1 from the mean."""
    along = np.arange(256) % 64
    saw = np.where(along < 44, along / 44.0, (64 - along) / 20.0)
    maps = baked(tmp_path, saw[None, :] * np.ones((256, 1)), strength=60.0)
    assert np.abs(maps["dudv"].finest).max() > 0.999
    assert [str(finding) for finding in check_maps({k: maps[k] for k in ("normal", "dudv")})] == []
