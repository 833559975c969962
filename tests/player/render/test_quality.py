"""Quality: each feature changes its own effect only, and higher tiers approach the reference."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from paradize.data import Texture
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.metrics.picture import Picture, flip
from tests.pictures import load
from tests.player.synthetic import SUN, checker, identity, write_scene
from tests.sweeps import sweep

Player = Callable[..., Any]
Draw = Callable[..., Picture]


@pytest.fixture
def draw(player: Player, tmp_path: Path) -> Draw:
    """Draws a scene folder with command-line options."""

    def picture(folder: Path, *options: object, size: str = "128x72", time_s: float = 1.0) -> Picture:
        out = tmp_path / "picture.png"
        checks = ("--check-finite", "--debug")
        result = player(folder, "--size", size, "--time", time_s, "--screenshot", out, *checks, *options)
        assert result.returncode == 0, result.stderr
        return load(out)

    return picture


def error(reference: Picture, test: Picture) -> float:
    return float(flip(reference, test).mean())


def at(feature: str, tier: str) -> tuple[str, str]:
    return "--quality", f"{feature}={tier}"


def filtered(fmt: str, texels: NDArray[np.uint8]) -> bytes:
    """KTX2 of (64, 64, c) texels with averaged mips, unlike those of the synthetic scene."""
    levels = [texels.astype(np.float64)]
    while len(levels[-1]) > 1:
        fine = levels[-1]
        levels.append((fine[::2, ::2] + fine[1::2, ::2] + fine[::2, 1::2] + fine[1::2, 1::2]) / 4.0)
    data = tuple(np.ascontiguousarray(np.round(level).astype(np.uint8)).tobytes() for level in levels)
    return encode_ktx2(Texture(fmt, 64, 64, data))


def relief(folder: Path) -> Path:
    """The scene with a strong relief on its box and without water."""
    write_scene(folder)
    y, x = np.mgrid[0:64, 0:64]
    waves = np.sin(x * np.pi / 8) * np.sin(y * np.pi / 8)
    height = np.round(127.5 + 127.0 * waves).astype(np.uint8)[..., None]
    scene = json.loads((folder / "scene.json").read_text())
    for name, data in (
        ("box_height", filtered("R8_UNORM", height)),
        ("box_color", filtered("RGBA8_SRGB", checker((200, 60, 40), (240, 220, 200)))),
    ):
        (folder / f"{name}.ktx2").write_bytes(data)
        same = {"file": f"{name}.ktx2", **identity(data)}
        scene["artifacts"][name] = scene["artifacts"]["box_color"] | same
    for material in scene["objects"][0]["materials"].values():
        material["maps"]["height"] = "box_height"
        material |= {"parallax_scale": 0.12, "parallax_bias": 0.0}
    scene["shadow"] = None
    scene["water"] = scene["reflection"] = scene["refraction"] = None
    (folder / "scene.json").write_text(json.dumps(scene))
    return folder


def changed(folder: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    scene = json.loads((folder / "scene.json").read_text())
    change(scene)
    (folder / "scene.json").write_text(json.dumps(scene))
    return folder


def wide_sun(scene: dict[str, Any]) -> None:
    """A wide sun and a box high above the ground: a broad penumbra. No water."""
    scene["sun"]["angular_diameter_rad"] = 0.06
    along = 12.0 / SUN[1]
    scene["objects"][0]["instances"][0] |= {"position": [along * x for x in SUN], "scale": [1.5] * 3}
    scene["water"] = scene["reflection"] = scene["refraction"] = None
    scene["particles"] = []


def calm_sea(scene: dict[str, Any]) -> None:
    """The box at the edge of a sea that hardly distorts its reflection."""
    scene["water"] |= {
        "level_m": 0.05,
        "reflection_distortion": 0.0005,
        "refraction_distortion": 0.0005,
        "absorption_per_m": [0.01] * 3,
    }
    scene["particles"] = []
    scene["shadow"] = None


def test_balanced_is_the_default(draw: Draw, tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene")
    assert np.array_equal(draw(folder), draw(folder, "--quality", "balanced"))


def test_shadows_approach_the_reference_from_fast_to_exact(draw: Draw, tmp_path: Path) -> None:
    folder = changed(write_scene(tmp_path / "scene"), wide_sun)
    truth = draw(folder, "--reference", 32)
    errors = [error(truth, draw(folder, *at("shadow", tier))) for tier in ("fast", "balanced", "exact")]
    assert errors[0] > errors[1] > errors[2] > 0.0, errors


@pytest.mark.deep
def test_a_finer_reflection_is_nearer_to_the_reference(draw: Draw, tmp_path: Path) -> None:
    folder = changed(write_scene(tmp_path / "scene"), calm_sea)
    truth = draw(folder, "--reference", 64)
    errors = [error(truth, draw(folder, *at("reflection", tier))) for tier in ("fast", "balanced", "exact")]
    assert errors[0] > errors[1] > errors[2] > 0.0, errors


@pytest.mark.deep
def test_more_steps_of_parallax_are_nearer_to_the_reference(draw: Draw, tmp_path: Path) -> None:
    folder, size = relief(tmp_path / "scene"), "320x180"
    truth = draw(folder, "--reference", 32, size=size)
    tiers = ("fast", "balanced", "exact")
    errors = [error(truth, draw(folder, *at("parallax", tier), size=size)) for tier in tiers]
    assert errors[0] > errors[1] > errors[2] > 0.0, errors


def test_a_feature_changes_nothing_in_scenes_without_it(draw: Draw, tmp_path: Path) -> None:
    dry = changed(write_scene(tmp_path / "scene"), wide_sun)
    size = "96x54"
    plain = draw(dry, size=size)
    for feature in ("reflection", "refraction", "parallax"):
        for tier in ("fast", "exact"):
            assert np.array_equal(draw(dry, *at(feature, tier), size=size), plain), (feature, tier)


def test_shadow_quality_changes_shadow_edges_only(draw: Draw, tmp_path: Path) -> None:
    folder = changed(write_scene(tmp_path / "scene"), wide_sun)
    plain = draw(folder, "--disable", "post")
    lit = np.abs(draw(folder, "--disable", "post,shadow") - plain).max(axis=2) > 0.02
    for tier in ("fast", "exact"):
        moved = np.abs(draw(folder, "--disable", "post", *at("shadow", tier)) - plain).max(axis=2) > 0.02
        assert moved.any()
        near = np.zeros_like(lit)
        for dy in range(-4, 5):
            for dx in range(-4, 5):
                near |= np.roll(lit, (dy, dx), (0, 1))
        assert not (moved & ~near).any()


def test_the_reference_is_not_shifted_against_normal_frames(draw: Draw, tmp_path: Path) -> None:
    """With sharp edges everywhere, a shift of half a pixel in any direction errs more than no shift."""
    folder = changed(write_scene(tmp_path / "scene", bare=True), lambda scene: None)
    truth = draw(folder, "--reference", 32)
    plain = draw(folder)
    here = error(truth, plain)
    doubled = np.repeat(np.repeat(plain, 2, 0), 2, 1)
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        half = np.roll(doubled, (dy, dx), (0, 1)).reshape(72, 2, 128, 2, 3).mean(axis=(1, 3))
        moved = error(truth[2:-2, 2:-2], np.ascontiguousarray(half[2:-2, 2:-2], dtype=np.float32))
        assert moved > 1.2 * here, (dy, dx, moved, here)


@pytest.mark.deep
def test_the_reference_converges_and_is_the_same_each_time(draw: Draw, tmp_path: Path) -> None:
    folder = changed(write_scene(tmp_path / "scene"), wide_sun)
    four, sixteen, many = (draw(folder, "--reference", n) for n in (4, 16, 64))
    assert error(many, sixteen) < error(many, four)
    assert np.array_equal(many, draw(folder, "--reference", 64))


def test_a_reference_of_one_frame_has_no_jitter_and_the_same_post_pass(draw: Draw, tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene", bare=True)
    one, plain = draw(folder, "--reference", 1), draw(folder)
    inner = np.abs(one - plain).max(axis=2) > 0.02  # only at edges: one sample per pixel instead of four
    assert 0.0 < inner.mean() < 0.1


WORDS = ["--quality=fast", "--quality=exact", "--reference=4"]


@pytest.mark.parametrize("word", sweep(WORDS, test=["--quality=exact"]))
def test_every_quality_is_finite(draw: Draw, tmp_path: Path, word: str) -> None:
    assert draw(write_scene(tmp_path / "scene"), word).std() > 0.05


@pytest.mark.deep
@pytest.mark.parametrize("word", WORDS)
def test_every_quality_is_finite_on_the_island(draw: Draw, island: Path, word: str) -> None:
    assert draw(island, word, time_s=75.0).std() > 0.05


@pytest.mark.deep
def test_fps_reports_its_choice_and_whether_the_rate_is_reached(player: Player, tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene")
    report = {}
    for rate in ("0.01", "1000"):
        result = player(folder, "--size", "64x36", "--fps", rate, "--frames", 3, "--json")
        assert result.returncode == 0, result.stderr
        report[rate] = json.loads(result.stdout)
        assert report[rate]["fps"]["budget_ms"] == pytest.approx(1000.0 / float(rate))
        assert ("the fastest quality needs" in result.stderr) == (rate == "1000")
    slow = report["0.01"]
    assert slow["fps"]["reached"] and not report["1000"]["fps"]["reached"]
    assert slow["features"] == ["shadow", "reflection", "refraction", "lod", "resolution"]
    # A very long budget gives the quality with the least error: exact, which of the resolution is balanced.
    assert {slow["quality"][feature] for feature in slow["features"][:-1]} == {"exact"}
    assert slow["quality"]["resolution"] == "balanced"
    assert set(slow["fps"]["calibration"]) == set(slow["features"])


def test_fps_uses_the_errors_measured_for_this_scene(player: Player, tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene", bare=True)
    errors = {"fast": 0.1, "balanced": 0.2, "exact": 0.3}
    points = [{"tier": tier, "error": {"mean": mean}} for tier, mean in errors.items()]
    measured = {"version": 1, "groups": [{"name": "lod", "time": "frame", "points": points}]}
    beside = tmp_path / "scene.tradeoff.json"
    beside.write_text(json.dumps(measured))
    result = player(folder, "--size", "64x36", "--fps", "0.01", "--frames", 1, "--json")
    assert json.loads(result.stdout)["quality"]["lod"] == "fast"
    beside.write_text("{")
    broken = player(folder, "--size", "64x36", "--fps", "0.01", "--frames", 1)
    assert broken.returncode == 1
    assert "scene.tradeoff.json" in broken.stderr


def test_bench_reports_frames_quartiles_and_passes(player: Player, tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene")
    result = player(folder, "--size", "64x36", "--bench", "--frames", 8, "--json", "--quality", "shadow=fast")
    report = json.loads(result.stdout)
    bench = report["bench"]
    assert report["quality"]["shadow"] == "fast"
    assert len(bench["frames_ms"]) == 8
    summary_ms = [bench[name] for name in ("low_ms", "median_ms", "high_ms", "p95_ms")]
    assert sorted(summary_ms) == summary_ms and set(summary_ms) <= set(bench["frames_ms"])
    assert list(bench["passes_ms"]) == [
        "views",
        "clear",
        "shadow",
        "reflection",
        "refraction",
        "terrain",
        "objects",
        "sky",
        "water",
        "particles",
        "post",
        "resolve",
    ]
    assert bench["passes_clock"] == "processor"  # the device's stamps of a software rasteriser are wrong
    assert all(ms >= 0.0 for ms in bench["passes_ms"].values())
