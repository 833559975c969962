"""Aliasing in motion: how much pixels change while the picture moves by quarters of a pixel, beside the same
of pictures of four times the size, averaged in display light. What is filtered well changes little."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from row import CORES, Row, on
from streamed import play
from tests.places import ROOT

F64 = npt.NDArray[np.float64]
ISLAND = ROOT / "build/assets/island"
WIDTH, HEIGHT, FINER = 320, 180, 4
SHIFTS_PX = (0.0, 0.25, 0.5, 0.75)
MOMENTS_S = {30: "jetty", 165: "sun on the sea", 214: "lamps on waves"}
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def at_second(flight: dict[str, list[list[float]]], name: str, second: float) -> F64:
    """The eye or the target, near enough to know which way is right."""
    table = np.array(flight["time_table"])
    u = float(np.interp(second, table[:, 0], table[:, 1]))
    segment = flight["segments"][min(int(u), len(flight["segments"]) - 1)]
    return np.array([np.polynomial.Polynomial(axis)(u - int(u)) for axis in segment[name]])  # type: ignore[call-overload]


def turned(folder: Path, second: float, shift_px: float) -> None:
    """Writes scene.json with a camera that is turned to the right by a part of a pixel at that second."""
    scene = json.loads((ISLAND / "scene.json").read_text())
    eye, target = (at_second(scene["flight"], name, second) for name in ("eye", "target"))
    ray = target - eye
    right = np.cross(ray, [0.0, 1.0, 0.0])
    step = right / np.linalg.norm(right) * np.linalg.norm(ray)
    step *= shift_px * 2 * np.tan(scene["flight"]["fov_rad"] / 2) / HEIGHT
    for segment in scene["flight"]["segments"]:
        for axis, move in zip(segment["target"], step, strict=True):
            axis[0] += float(move)
    (folder / "scene.json").write_text(json.dumps(scene))


def luminance(path: Path) -> F64:
    """(180, 320), encoded, 0 to 255; of a larger picture the mean in display light."""
    encoded = np.asarray(Image.open(path).convert("RGB"), np.float64) / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4) @ LUMINANCE
    finer = linear.shape[0] // HEIGHT
    mean = linear.reshape(HEIGHT, finer, WIDTH, finer).mean(axis=(1, 3))
    return 255 * np.where(mean <= 0.0031308, 12.92 * mean, 1.055 * np.maximum(mean, 0) ** (1 / 2.4) - 0.055)


def rows(runs: int, folder: Path) -> Iterator[Row]:
    del runs  # the pictures are the same each time
    scene, picture = folder / "turned", folder / "picture.png"
    shutil.copytree(ISLAND, scene)
    for second, name in MOMENTS_S.items():
        seen: dict[int, list[F64]] = {1: [], FINER: []}
        for shift_px in SHIFTS_PX:
            turned(scene, second, shift_px)
            for finer, pictures in seen.items():
                size = f"{finer * WIDTH}x{finer * HEIGHT}"
                play(scene, "--time", second, "--size", size, "--screenshot", picture)
                pictures.append(luminance(picture))
        change, least = (float(np.std(pictures, axis=0).mean()) for pictures in seen.values())
        error = float(np.abs(seen[1][0] - seen[FINER][0]).mean())
        yield Row(
            f"change of pixels while the picture moves, {second} s, {name}", change,
            f"{FINER} x {FINER} pixels for each", least, f"mean error {error:.2f} of 255", "-", 1 / 2,
            "of 255", inside=f"mean deviation over {len(SHIFTS_PX)} pictures of {WIDTH} x {HEIGHT}",
            ours_on=on(CORES), peer_on=on(CORES),
        )  # fmt: skip
