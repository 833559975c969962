"""What the island's flight saves: bytes of its path-aware bake beside those of a full one, and how far the
frames of both are apart.

Full is defined in tests/pipeline/full_bake.py: all four maps of every picture (of height maps too), all mips,
all levels of detail with all attributes, every patch of the terrain at the same error. A second row leaves
out of it the maps of the colours whose heights are painted in pictures of their own: the same relief twice.
The frames are those of the scene's viewport at ten moments, rendered by the player from both bakes.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from paradize.bake_tasks import How
from row import Row
from tests.pictures import flip_map, load
from tests.pipeline.full_bake import Sizes, full_bake, measure_sizes
from tests.places import ROOT

ISLAND = ROOT / "raw_assets" / "island.toml"
PLAYER = ROOT / "build" / "bin" / "paradize-player"
MOMENTS_S = (5.0, 22.0, 40.0, 62.0, 85.0, 113.0, 140.0, 165.0, 190.0, 214.0)


def frames_apart(
    path_aware: Path, full: Path, moments_s: tuple[float, ...], folder: Path
) -> dict[str, float]:
    """The worst of all moments: FLIP's mean and largest pixel, PSNR in dB (infinite where frames are equal),
    and how many frames are the same byte by byte."""
    flips, largest, squares, same = [], [], [], 0
    for moment in moments_s:
        pictures = []
        for scene in (path_aware, full):
            file = folder / f"{scene.name}_{moment:g}.png"
            at = ["--headless", "--time", f"{moment:g}", "--mute"]
            subprocess.run([PLAYER, scene, *at, "--screenshot", file], check=True, capture_output=True)
            pictures.append(load(file))
        error = flip_map(pictures[1], pictures[0])
        flips.append(float(error.mean()))
        largest.append(float(error.max()))
        squares.append(float(np.mean((pictures[0] - pictures[1]) ** 2)))
        same += bool((pictures[0] == pictures[1]).all())
    worst = max(squares)
    psnr_db = float("inf") if worst == 0.0 else -10.0 * float(np.log10(worst))
    return {"flip_mean": max(flips), "flip_max": max(largest), "psnr_db": psnr_db, "same": float(same)}


def row_of(what: str, sizes: Sizes, full: int, frames: dict[str, float], limit: float | None) -> Row:
    ours = (
        f"FLIP mean {frames['flip_mean']:.2g}, largest {frames['flip_max']:.2g}, "
        f"PSNR {frames['psnr_db']:.4g} dB, "
        f"{frames['same']:.0f} of {len(MOMENTS_S)} frames the same byte by byte"
    )
    peer = f"largest source that the path needs: {sizes.source_name}, {sizes.source / 1e6:.2f} MB"
    return Row(what, sizes.path / 1e6, "the full bake", full / 1e6, ours, peer, limit, unit="MB")


def rows(runs: int, folder: Path) -> Iterator[Row]:
    del runs
    os.environ |= {"PARADIZE_STORE": str(folder / "store"), "PARADIZE_REPORT": ""}
    path_aware, full = folder / "path", folder / "full"
    from paradize.bake import bake

    for report in (bake(ISLAND, path_aware, How()), full_bake(ISLAND, full, How())):
        assert not report.errors, report.errors
    sizes = measure_sizes(ISLAND, path_aware, full)
    frames = frames_apart(path_aware, full, MOMENTS_S, folder)
    yield row_of("The island for its flight, bytes", sizes, sizes.full, frames, 2.0)
    twice = [name for name in sizes.parts if name.startswith(("sand_height_", "effect_height_"))]
    less = sizes.full - sum(sizes.parts[name] for name in twice)
    yield row_of("The same, each relief once", sizes, less, frames, None)
