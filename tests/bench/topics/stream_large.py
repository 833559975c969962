"""The largest scenes that stream: 2 GB of maps, and a terrain of 16385 x 16385, each under 256 MB.

Takes an hour; the terrain, which takes most of it to bake, is kept in build/bench (1.6 GB).
"""

from __future__ import annotations

import statistics
import subprocess
from collections.abc import Iterator
from pathlib import Path

from row import CORES, Row, on
from streamed import colored, play
from tests.made.hills import hills_scene
from tests.places import ROOT
from tests.player.boxes import row_of_boxes
from topics.stream import EDGE, ISLAND, SECONDS, bench_large

LONG = True  # runs only where it is named
BOXES = 90  # 2.01 GB of textures
LIMIT_MB = 256
SIDE, BOUND_M = 16385, 1.0
FRAMES = 90  # of the terrain's flight of a minute
HILLS = ROOT / "build/bench/hills"


def baked_hills() -> Path:
    out = HILLS / "baked"
    if not (out / "scene.json").is_file():
        scene = hills_scene(HILLS / "scene", SIDE, BOUND_M)
        paradize = ROOT / "build/venv/bin/paradize"
        subprocess.run([paradize, "bake", scene, "-o", out, "-j", "1"], check=True)
    return out


def bench_frame(hills: Path, runs: int) -> Row:
    """In turns: other work on the machine meets both."""

    def frame_ms(scene: Path, second: int, *limit: object) -> float:
        arguments = ("--size", "640x360", "--wait-resident", "--frames", 4, "--time", second, *limit)
        return float(play(scene, *arguments)["frame_ms"])

    ours, island = [], []
    for _ in range(runs):
        ours.append(frame_ms(hills, 3, "--vram", LIMIT_MB))
        island.append(statistics.mean(frame_ms(ISLAND, second) for second in (10, 75, 150)))
    return Row(
        f"a frame of a terrain of {SIDE} x {SIDE} under {LIMIT_MB} MB", statistics.median(ours),
        "the mean of the island's at 10, 75 and 150 s", statistics.median(island), "-", "-", 1 / 1.5,
        inside="640 x 360, second 3, all that is needed resident", ours_on=on(CORES), peer_on=on(CORES),
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    hills = baked_hills()
    yield bench_frame(hills, runs)
    yield from bench_large(hills, folder / "hills-pictures", LIMIT_MB, FRAMES, runs=2)
    maps = (colored(EDGE, i) for i in range(BOXES))
    boxes = row_of_boxes(folder / "boxes", maps, spacing_m=6.0, seconds=SECONDS)
    yield from bench_large(boxes, folder / "box-pictures", LIMIT_MB)
