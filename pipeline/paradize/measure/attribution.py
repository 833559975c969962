"""Which stage spends the frame's error: each in turn is swapped for its exact tier, and how much the final
picture changes is measured.

Pictures are the player's own, compared by FLIP: P. Andersson, J. Nilsson, T. Akenine-Moeller, M. Oskarsson,
K. Astroem and M. Fairchild, "FLIP: A Difference Evaluator for Alternating Images", 2020.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.data import six
from paradize.errors import BakeError, GroupedError
from paradize.files import open_file
from paradize.metrics.picture import flip
from paradize.scene.requirements import BakeJob
from paradize.scene.settings import Scene

SIZE = "320x180"
MOMENTS = 4  # of the flight, besides the poster's
_PATIENCE_S = 300.0
# The makers whose tasks are swapped together, and how a person calls them. Sky and sound have one tier.
STAGES = (
    ("mesh", "levels of detail"),
    ("terrain", "terrain"),
    ("color", "colour textures"),
    ("maps", "normal, height, gloss and du/dv maps"),
)
Told = Callable[[str, int, int], None]


def moments_of(scene: Scene) -> list[float]:
    """The seconds of the flight at which pictures are compared: the poster's, and others evenly apart."""
    duration = scene.flight.duration_s
    return [scene.head.poster_s, *(duration * (k + 0.5) / MOMENTS for k in range(MOMENTS))]


def swaps(orders: Sequence[BakeJob], tiers: Mapping[str, str]) -> list[tuple[str, list[str]]]:
    """The stages whose tier in use is not exact already, each with its tasks. tiers: by artifact."""
    found = []
    for maker, stage in STAGES:
        tasks = [
            order.name
            for order in orders
            if order.maker == maker
            and any(tiers.get(want.artifact) != "exact" for want in order.wants if want.kind)
        ]
        if tasks:
            found.append((stage, tasks))
    return found


def attribute(
    scene_path: Path,
    scene: Scene,
    stages: Sequence[tuple[str, list[str]]],
    used: Path,
    tier: str | None,
    player: Path,
    room: Path,
    told: Told | None = None,
) -> list[dict[str, Any]]:
    """What each of `stages` (from `swaps`) changes in the picture, as the entries of tradeoff.json.

    used: the folder baked in the tiers in use (`tier`). room: a folder for what is baked and drawn. Raises
    BakeError where the player fails, or what baking raises.
    """
    moments = moments_of(scene)
    before = pictures(player, used, moments, room / "used", told, "the tiers in use", 0, len(stages) + 1)
    found = []
    for at, (stage, tasks) in enumerate(stages):
        folder = room / "exact"
        if told:
            told(f"{stage} baked exact", at + 1, len(stages) + 1)
        report = bake(scene_path, folder, BuildOptions(tier=tier, tiers=dict.fromkeys(tasks, "exact")))
        if report.errors:
            raise GroupedError(report.errors)
        after = pictures(player, folder, moments, room / "drawn", told, stage, at + 1, len(stages) + 1)
        shutil.rmtree(folder)
        changes = np.concatenate([flip(a, b).reshape(-1) for a, b in zip(before, after, strict=True)])
        found.append(
            {
                "stage": stage,
                "flip_mean": six(float(changes.mean(dtype=np.float64))),
                "flip_p99": six(float(np.quantile(changes, 0.99))),
                "flip_max": six(float(changes.max())),
                "tasks": tasks,
                "moments_s": moments,
            }
        )
    if told:
        told("done", len(stages) + 1, len(stages) + 1)
    return found


def pictures(
    player: Path,
    folder: Path,
    moments: Sequence[float],
    room: Path,
    told: Told | None,
    what: str,
    done: int,
    of: int,
) -> list[npt.NDArray[np.float32]]:
    """What the player draws of a folder at these seconds, (h, w, 3), sRGB 0..1."""
    from PIL import Image

    room.mkdir(parents=True, exist_ok=True)
    found = []
    for second in moments:
        if told:
            told(f"{what} drawn at {second:g} s", done, of)
        file = room / "picture.png"
        command = [str(player), str(folder), "--headless", "--mute", "--size", SIZE, "--time", f"{second:g}"]
        try:
            subprocess.run(
                [*command, "--screenshot", str(file)],
                check=True,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                timeout=_PATIENCE_S,
            )
        except subprocess.CalledProcessError as failed:
            words = failed.stderr.decode(errors="replace").strip().splitlines()
            raise BakeError(f"drew nothing: {words[-1] if words else failed}", file=player) from None
        except (OSError, subprocess.TimeoutExpired) as failed:
            raise BakeError(f"drew nothing: {failed}", file=player) from None
        with open_file(file) as stream, Image.open(stream) as image:
            found.append(np.asarray(image.convert("RGB"), np.float32) / np.float32(255))
        file.unlink()
    return found
