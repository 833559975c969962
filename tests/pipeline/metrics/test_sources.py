"""The reference of a map comes from its picture, not from the stages: a wrong stage shows in the error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers import cubemap
from paradize.bakers.maps import bake as bake_maps
from paradize.bakers.maps import rows as bake_map_rows
from paradize.bakers.product import MapProduct
from paradize.data import Image, Texture
from paradize.kernels.maps import Levels
from paradize.metrics.source import linear_light, shaped, sky_error, true_gloss, true_heights
from paradize.stages.gloss import GlossSettings
from tests.pipeline.scenes import write_image

ODD = Levels(black=0.1, white=0.8, gamma=1.7, contrast=1.3, brightness=-0.05, invert=True)


def picture(kind: type, channels: int, seed: int = 3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    if kind is np.float32:
        return np.asarray(rng.uniform(0.0, 1.0, (32, 48, channels)), np.float32)
    smooth = (
        0.5 + 0.4 * np.sin(np.arange(48) / 5.0)[None, :, None] * np.cos(np.arange(32) / 7.0)[:, None, None]
    )
    values = smooth + rng.uniform(-0.05, 0.05, (32, 48, channels))
    return np.asarray(np.round(values * np.iinfo(kind).max), kind)  # type: ignore[call-overload]


def save(path: Path, pixels: np.ndarray) -> Path:
    write_image(path, pixels)
    return path


def spoilt(stage: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
    """The stage with a twentieth of its result missing."""
    return lambda *given, **more: np.float32(0.95) * stage(*given, **more)


@pytest.mark.parametrize("source", ["color", "height"])
@pytest.mark.parametrize("fmt", ["ktx2", "png"])
def test_heights_that_are_wrong_show_in_every_maps_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str, fmt: str
) -> None:
    smooth = 0.5 + 0.3 * np.sin(np.arange(48) / 5.0) * np.cos(np.arange(32) / 7.0)[:, None]
    path = save(tmp_path / "picture.exr", np.repeat(smooth.astype(np.float32)[:, :, None], 3, axis=2))

    def made() -> dict[str, MapProduct]:
        return bake_maps.bake_maps(path, source=source, fmt=fmt, strength=20.0)

    sound = made()
    for name in ("height_from_color", "height_from_height"):
        monkeypatch.setattr(bake_maps, name, spoilt(getattr(bake_maps, name)))
    wrong = made()
    for name in ("height", "gloss"):
        metric = f"{name}_psnr_db"
        assert wrong[name].errors[metric] < 36.0 < sound[name].errors[metric] - 2.0, name
    for name in ("normal", "dudv"):
        metric = f"{name}_mean_deg"
        assert wrong[name].errors[metric] > sound[name].errors[metric] + 0.2, name


@pytest.mark.parametrize("shape", [{}, asdict(ODD)])
def test_gloss_that_is_wrong_shows_in_its_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shape: dict[str, Any]
) -> None:
    path = save(tmp_path / "picture.png", picture(np.uint8, 3))
    sound = bake_maps.bake_maps(path, only=["gloss"], **shape)["gloss"]
    monkeypatch.setattr(bake_map_rows, "gloss_map", spoilt(bake_map_rows.gloss_map))
    wrong = bake_maps.bake_maps(path, only=["gloss"], **shape)["gloss"]
    assert wrong.errors["gloss_psnr_db"] < 36.0 < sound.errors["gloss_psnr_db"]
    assert wrong.errors["gloss_width_mean_deg"] > sound.errors["gloss_width_mean_deg"] + 0.1


def test_a_sky_whose_light_is_wrong_shows_in_its_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faces = [save(tmp_path / f"{k}.png", picture(np.uint16, 3, seed=k)[:32, :32]) for k in range(6)]
    assert cubemap.bake_cubemap(faces).errors["sky_max_relative"] < 0.002
    monkeypatch.setattr(cubemap, "linear_light", spoilt(cubemap.linear_light))
    assert cubemap.bake_cubemap(faces).errors["sky_max_relative"] > 0.04


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_the_reference_is_the_formula_of_the_standards(kind: Any, channels: int) -> None:
    values = picture(kind, channels)
    share = values.astype(np.float64) / (1.0 if kind is np.float32 else np.iinfo(kind).max)
    linear = np.where(share > 0.04045, ((share + 0.055) / 1.055) ** 2.4, share / 12.92)
    assert np.abs(linear_light(values, encoded=True) - linear).max() < 1e-14
    assert np.abs(linear_light(values, encoded=False) - share).max() < 1e-15

    def grey(of: np.ndarray) -> np.ndarray:
        return of[:, :, 0] if channels < 3 else of[:, :, :3] @ [0.2126, 0.7152, 0.0722]

    def curve(y: np.ndarray) -> np.ndarray:
        t = np.clip((y - 0.1) / 0.7, 0.0, 1.0) ** (1.0 / 1.7)
        return 1.0 - np.clip((t - 0.5) * 1.3 + 0.45, 0.0, 1.0)

    image = Image(values, "srgb", 8)
    assert np.abs(true_heights(image, "color", None) - grey(linear)).max() < 1e-7
    assert np.abs(true_heights(image, "color", ODD) - curve(grey(linear))).max() < 1e-7
    assert np.abs(true_heights(image, "height", None) - grey(share)).max() < 1e-7
    assert np.abs(shaped(grey(share), ODD) - curve(grey(share))).max() < 1e-14
    settings = GlossSettings(ODD, (0.1, 0.9), (0.2, 0.7))
    found = true_gloss(grey(share), settings.levels, settings.specular, settings.smoothness)
    expected = np.stack([0.1 + 0.8 * curve(grey(share)), 0.2 + 0.5 * curve(grey(share))], axis=2)
    assert np.abs(found - expected).max() < 1e-7


def test_what_the_codes_of_heights_leave_open_is_told_beside_an_error_of_none(tmp_path: Path) -> None:
    """A slope of one code a texel: each half step leaves open what its neighbours span."""
    across = np.tile(np.arange(256, dtype=np.uint8), (256, 1))[:, :, None]
    errors = {}
    for name, values in (
        ("coarse.png", across),
        ("fine.png", across.astype(np.uint16) * 250),
        ("float.exr", across.astype(np.float32) / np.float32(255)),
    ):
        path = save(tmp_path / name, values)
        made = bake_maps.bake_maps(path, only=["normal"], source="height", slope_scale=100.0)
        errors[name] = made["normal"].errors
    opened = [errors[name]["normal_open_p99_deg"] for name in ("coarse.png", "fine.png", "float.exr")]
    assert opened[0] > 5.0 > 0.2 > opened[1] > opened[2] == 0.0
    for found in errors.values():
        assert found["normal_open_deg"] <= found["normal_open_p99_deg"] <= found["normal_open_max_deg"]
    # Slopes of the eighth order, each of the texels' heights half a code off in the worst way.
    weights = 2.0 * (4 / 5 + 1 / 5 + 4 / 105 + 1 / 280) * 0.5 / 255.0 * 100.0
    slope = 100.0 / 255.0
    level, steep = np.array([-slope, 0.0, 1.0]), np.array([-slope + weights, weights, 1.0])
    cosine = level @ steep / np.linalg.norm(level) / np.linalg.norm(steep)
    assert errors["coarse.png"]["normal_open_deg"] == pytest.approx(np.degrees(np.arccos(cosine)), rel=0.1)


def test_dark_texels_of_a_sky_count_by_their_own_light() -> None:
    shown = np.zeros((6, 1, 1, 4), np.float16)
    shown[2, 0, 0, 1] = 0.0015
    texture = Texture("RGBA16F", 1, 1, (shown.tobytes(),), faces=6)
    faces: list[tuple[Any, bool]] = [(np.zeros((1, 1, 3), np.float32), False) for _ in range(6)]
    faces[2] = (np.array([[[0.0, 0.001, 0.0]]], np.float32), False)
    assert sky_error(texture, faces) == pytest.approx(0.5, rel=0.01)
