"""Streaming: start, order, worst frame, and a scene several times larger than its limit of device memory.

The player runs headless, so a frame waits for the data that its schedule names;
times are those that it states in --json. The curve of error against seconds goes to build/bench/stream.svg.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import time
import tomllib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from paradize.data import Mesh
from paradize.readers.obj import read_obj
from paradize.stages.normals import complete_normals
from paradize.stages.tangents import tangent_frames
from row import CORES, Row, on
from stream_chart import CHART, Curve, draw
from streamed import colored, play, without_data
from tests.conftest import SOFTWARE_RENDERING
from tests.pictures import difference
from tests.places import ROOT
from tests.player.boxes import row_of_boxes

ISLAND = ROOT / "build/assets/island"
SIZE = ("--size", "320x180")
BOXES, EDGE, SECONDS = 48, 2048, 24.0  # 1.07 GB of textures
FRAMES = int(SECONDS * 30)
LIMIT_MB = 128  # an eighth of it, as 256 MB are of 2 GB
LIKE_FLIP = 0.15  # a picture is recognisable up to this FLIP to the final one
RUNS = 4  # of the flight, for its worst frame
STEP = 15  # frames from one compared picture to the next


def curve(report: dict[str, Any]) -> Curve:
    return [(second, error) for second, error, *_ in report["streaming"]["frames"]]


def first_like(scene: Path, folder: Path) -> tuple[int, float]:
    """The first frame that is recognisable, and its FLIP to the final one of the same moment."""
    folder.mkdir()
    play(scene, *SIZE, "--frames", 8, "--screenshot", folder / "stream.png")
    play(scene, *SIZE, "--frames", 8, "--wait-resident", "--screenshot", folder / "whole.png")
    for frame in range(8):
        found = difference(folder / f"whole_{frame:04}.png", folder / f"stream_{frame:04}.png")["flip"]
        if found <= LIKE_FLIP:
            return frame, found
    raise AssertionError("no frame of eight is like the final one")


def bench_start(name: str, scene: Path, folder: Path, runs: int) -> Row:
    """Beside the same shaders and draw calls with textures of one texel."""
    frame, flip = first_like(scene, folder / f"{name}-pictures")
    bare = without_data(scene, folder / f"{name}-bare")
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(2):  # the driver compiles other variants of the shaders for it, and keeps them
        play(bare, *SIZE, "--frames", 1)
    for _ in range(runs):
        times[0].append(curve(play(scene, *SIZE, "--frames", frame + 1))[frame][0] * 1e3)
        times[1].append(curve(play(bare, *SIZE, "--frames", 1))[0][0] * 1e3)
    return Row(
        f"start to a recognisable picture, {name}", statistics.median(times[0]),
        "the same shaders and draw calls, one texel in each texture", statistics.median(times[1]),
        f"frame {frame}, FLIP {flip:.3f} to the final one", "-", 1 / 1.3,
        inside="from the start of the program to the end of the frame", ours_on=on(CORES), peer_on=on(CORES),
    )  # fmt: skip


def area(points: Curve, seconds: float) -> float:
    """Below the curve's steps, until `seconds`."""
    ended = [*points, (max(seconds, points[-1][0]), points[-1][1])]
    return sum((min(b[0], seconds) - a[0]) * a[1] for a, b in pairwise(ended) if a[0] < seconds)


def bench_order(runs: int) -> Row:
    """The error's area in the first ten seconds, after the first frame of both."""
    found: dict[str, list[Curve]] = {"needs": [], "file": []}
    for _ in range(min(runs, 3)):
        for order, curves in found.items():
            curves.append(curve(play(ISLAND, *SIZE, "--frames", 45, "--order", order)))
    areas = {order: statistics.median(area(one, 10.0) for one in curves) for order, curves in found.items()}
    draw({order: curves[-1] for order, curves in found.items()})
    return Row(
        "error on screen x seconds, the first ten of the island", areas["needs"], "the order of scene.json",
        areas["file"], "as a multiple of the accepted error", "the same", 2, "x s",
        inside="from the end of the first frame on", ours_on=on(CORES), peer_on=on(CORES),
    )  # fmt: skip


def frame_ms(reports: list[dict[str, Any]]) -> float:
    """The 99th percentile of the frames but the first, which compile shaders. Of each frame the least of the
    runs: they draw the same frames, so what is more in one of them is other work on the machine."""
    seconds = np.array([[second for second, _ in curve(report)] for report in reports])
    return float(np.percentile(np.diff(seconds[:, 5:]).min(axis=0) * 1e3, 99))


def bench_large(
    scene: Path, folder: Path, limit_mb: int = LIMIT_MB, frames: int = FRAMES, runs: int = RUNS
) -> Iterator[Row]:
    """A scene several times larger than its limit, over its flight."""
    folder.mkdir()
    flight = (*SIZE, "--frames", frames)
    played = [
        (play(scene, *flight, "--vram", limit_mb), play(scene, *flight, "--wait-resident"))
        for _ in range(runs)
    ]
    limited = played[0][0]
    yield Row(
        "worst frame (99th percentile) while a scene streams under its limit",
        frame_ms([run[0] for run in played]), "the same flight, all resident",
        frame_ms([run[1] for run in played]), "-", "-", 1 / 1.5,
        inside=f"{frames} frames without the first, of each the least of {runs} runs",
        ours_on=on(CORES), peer_on=on(CORES),
    )  # fmt: skip
    play(scene, *flight, "--vram", limit_mb, "--screenshot", folder / "limited.png")
    play(scene, *flight, "--wait-resident", "--screenshot", folder / "whole.png")
    flips = [
        difference(folder / f"whole_{i:04}.png", folder / f"limited_{i:04}.png")["flip"]
        for i in range(0, frames, STEP)
    ]
    result = limited["streaming"]
    megabytes = limited["total_bytes"] / 1e6
    yield Row(
        f"{megabytes:.0f} MB under {limit_mb} MB: peak on the device", result["peak_bytes"] / 1e6,
        "the limit", limit_mb, f"{result['evictions']} evictions; FLIP to the unlimited flight: mean "
        f"{statistics.mean(flips):.5f}, worst {max(flips):.4f}", "-", 1 / 1.1, "MB",
        inside="meshes and textures with the copies that uploads need", ours_on=on(CORES), peer_on="-",
    )  # fmt: skip
    yield Row(
        f"{megabytes:.0f} MB under {limit_mb} MB: mean FLIP to the unlimited flight, x 1000",
        max(statistics.mean(flips) * 1e3, 1e-3), "the limit", 20, f"worst {max(flips):.4f}", "-", 1, "",
        inside=f"{len(flips)} of {frames} frames", ours_on=on(CORES), peer_on="-",
    )  # fmt: skip


def load_model(path: Path) -> Mesh:
    """An OBJ with its tangents, by our own reader and MikkTSpace: the quickest of `topics=obj,tangents`."""
    model = read_obj(path)
    mesh, _ = complete_normals(model.mesh, model.smoothing, crease_deg=60.0)
    return tangent_frames(mesh) if mesh.uvs is not None else mesh


def bench_naive(runs: int) -> Row:
    """To checked headers, beside a loader that reads pictures and models themselves. To its favour it
    compresses nothing, and reads no skies, terrain and sounds."""
    raw = ROOT / "raw_assets"
    scene = tomllib.loads((raw / "island.toml").read_text())
    models = [raw / item["mesh"] for item in scene["object"]]
    bake = json.loads((ISLAND / "scene.json").read_text())
    pictures = [ISLAND / entry["file"] for entry in bake["artifacts"].values() if entry["kind"] == "texture"]
    made = [Path(str(CHART.parent / "naive") + f"{i}.png") for i in range(len(pictures))]
    random = np.random.default_rng(1)
    for path, source in zip(made, pictures, strict=True):
        edge = int.from_bytes(source.read_bytes()[20:24], "little")
        smooth = np.kron(
            random.integers(0, 256, (edge // 8, edge // 8, 3), np.uint8), np.ones((8, 8, 1), np.uint8)
        )
        Image.fromarray(smooth).save(path, compress_level=1)
    ours, peer = [], []
    for _ in range(runs):
        ours.append(play(ISLAND, *SIZE, "--frames", 1)["streaming"]["open_ms"])
        start = time.process_time()
        for path in made:
            image = Image.open(path).convert("RGB")
            while image.width > 1:
                image = image.reduce(2)
        for path in models:
            load_model(path)
        peer.append((time.process_time() - start) * 1e3)
    for path in made:
        path.unlink()
    return Row(
        "island to checked headers", statistics.median(ours),
        "PNG of the same sizes: decode, mips (Pillow); OBJ: parse, tangents (ours)",
        statistics.median(peer), "-", "-", 100,
        inside="processor time; files in the page cache", ours_on=on(CORES), peer_on=on(1),
    )  # fmt: skip


def bench_resident(runs: int, folder: Path) -> Iterator[Row]:
    """To all of the island on the device, beside the same files read whole and uploaded without a check: in
    starts that check all files, and in those after one that did."""
    for arguments in (["--preset", "test"], ["--build", "--preset", "test", "--target", "paradize-resident"]):
        subprocess.run([ROOT / "build/venv/bin/cmake", *arguments], cwd=ROOT, check=True, capture_output=True)
    environment = {**os.environ, **SOFTWARE_RENDERING}

    def start(who: str, records: str) -> dict[str, float]:
        command = [ROOT / "build/player/bin/paradize-resident", ISLAND, who]
        given = environment | {"PARADIZE_CHECKED": records}
        done = subprocess.run(command, check=True, capture_output=True, env=given)
        times: dict[str, float] = json.loads(done.stdout)
        return times

    for name, records in (("a first start", ""), ("later starts", str(folder / "checked"))):
        start("ours", records)
        turns = [(start("ours", records), start("peer", records)) for _ in range(2 * runs + 1)]
        ours, peer = (
            {clock: statistics.median(turn[i][clock] for turn in turns) for clock in turns[0][i]}
            for i in (0, 1)
        )
        share = ours["processor_ms"] / peer["processor_ms"]
        yield Row(
            f"island to all of it on the device, {name}", ours["ms"], "each file read, its bytes uploaded",
            peer["ms"], f"{share:.1f} x its processor time", "-", 1 / 1.3, ours_on=on(CORES), peer_on=on(1),
            inside="a new process each; from closed files to glFinish(); files in the page cache",
        )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    assert (ISLAND / "scene.json").is_file(), "make assets bakes the island"
    yield bench_start("the island", ISLAND, folder, runs)
    yield bench_order(runs)
    yield bench_naive(runs)
    yield from bench_resident(runs, folder)
    maps = (colored(EDGE, i) for i in range(BOXES))
    large = row_of_boxes(folder / "large", maps, spacing_m=6.0, seconds=SECONDS)
    yield bench_start("1 GB of maps", large, folder, runs)
    yield from bench_large(large, folder / "large-pictures")
