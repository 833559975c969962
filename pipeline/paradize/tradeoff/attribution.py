"""Which stage causes the error of the frame: each stage in turn is baked exact, and FLIP measures how much
the player's picture changes.

FLIP: P. Andersson, J. Nilsson, T. Akenine-Moeller, M. Oskarsson,
K. Astroem and M. Fairchild, "FLIP: A Difference Evaluator for Alternating Images", 2020.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.data import rounded
from paradize.errors import GroupedError
from paradize.jobs.progress import OnProgress
from paradize.metrics.picture import Picture, flip
from paradize.preview.player import read_picture, run_player
from paradize.scene.jobs import BakeJob
from paradize.scene.settings import Scene

SIZE = "320x180"
MOMENTS = 4  # of the flight, besides the poster's
# Makers whose jobs are swapped together, and the name of their stage. Sky and sound have one tier.
STAGES = (
    ("mesh", "levels of detail"),
    ("terrain", "terrain"),
    ("color", "colour textures"),
    ("maps", "normal, height, gloss and du/dv maps"),
    ("authored", "drawn normal, height, gloss and occlusion maps"),
)


def moments_of(scene: Scene) -> list[float]:
    """The seconds of the flight at which pictures are compared: the poster's, and MOMENTS others, evenly
    spaced."""
    duration = scene.flight.duration_s
    return [scene.head.poster_s, *(duration * (k + 0.5) / MOMENTS for k in range(MOMENTS))]


def swaps(jobs: Sequence[BakeJob], tiers: Mapping[str, str]) -> list[tuple[str, list[str]]]:
    """The stages that do not use tier exact already, each with the names of its jobs. tiers: by artifact."""
    stages = []
    for baker, stage in STAGES:
        names = [
            job.name
            for job in jobs
            if job.baker == baker
            and any(tiers.get(output.artifact) != "exact" for output in job.outputs if output.kind)
        ]
        if names:
            stages.append((stage, names))
    return stages


def attribute(
    scene_path: Path,
    scene: Scene,
    stages: Sequence[tuple[str, list[str]]],
    used: Path,
    tier: str | None,
    player: Path,
    scratch: Path,
    on_progress: OnProgress | None = None,
) -> list[dict[str, Any]]:
    """How much each of `stages` (from `swaps`) changes the picture, as the entries of tradeoff.json.

    used: the folder baked in the tiers in use (`tier`). scratch: a folder for bakes and pictures. Raises
    BakeError if the player fails, and what `bake` raises.
    """
    moments = moments_of(scene)
    total = len(stages) + 1

    def begin(step: str, done: int) -> None:
        if on_progress:
            on_progress(step, done, total)

    def draw(folder: Path, name: str, done: int) -> list[Picture]:
        return pictures(
            player, folder, moments, scratch / "drawn", lambda second: begin(f"{name} at {second:g} s", done)
        )

    before = draw(used, "tiers in use", 0)
    entries = []
    for at, (stage, names) in enumerate(stages, 1):
        folder = scratch / "exact"
        begin(f"{stage} baked exact", at)
        baked = bake(scene_path, folder, BuildOptions(tier=tier, tiers=dict.fromkeys(names, "exact")))
        if baked.errors:
            raise GroupedError(baked.errors)
        after = draw(folder, f"{stage} exact", at)
        shutil.rmtree(folder)
        changes = np.concatenate([flip(a, b).reshape(-1) for a, b in zip(before, after, strict=True)])
        entries.append(
            {
                "stage": stage,
                "flip_mean": rounded(float(changes.mean(dtype=np.float64))),
                "flip_p99": rounded(float(np.quantile(changes, 0.99))),
                "flip_max": rounded(float(changes.max())),
                "tasks": names,
                "moments_s": moments,
            }
        )
    begin("done", total)
    return entries


def pictures(
    player: Path,
    folder: Path,
    moments: Sequence[float],
    scratch: Path,
    on_picture: Callable[[float], None],
) -> list[Picture]:
    """The pictures that the player draws of a folder at these seconds, (h, w, 3), sRGB 0..1. on_picture hears
    each second before it is drawn."""
    scratch.mkdir(parents=True, exist_ok=True)
    drawn = []
    for second in moments:
        on_picture(second)
        file = scratch / "picture.png"
        run_player(player, folder, "--size", SIZE, "--time", f"{second:g}", "--screenshot", str(file))
        drawn.append(read_picture(file))
        file.unlink()
    return drawn
