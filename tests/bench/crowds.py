"""Frames of many instances on the baked island."""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from row import CORES, Row, on
from tests.conftest import SOFTWARE_RENDERING
from tests.made.crowd import write_crowd
from tests.places import ROOT

PLAYER = ROOT / "build/bin/paradize-player"
MOMENTS = (24, 62, 75, 110, 150, 190, 214, 230)  # of the flight, seconds


def drawn(folder: Path, frames: int, second: int = 75) -> dict[str, Any]:
    """The output of --json for some frames from this second on. At second 75 half of the island is in
    view."""
    command = [PLAYER, folder, "--headless", "--wait-resident", "--time", str(second)]
    command += ["--frames", str(frames), "--size", "160x90", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout))


def loaded_ms(folder: Path, second: int) -> float:
    """Processor time from the player's start to its end, with one frame of this second."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [PLAYER, folder, "--headless", "--mute", "--wait-resident", "--frames", "1"]
    command += ["--time", str(second), "--size", "160x90"]
    subprocess.run(command, check=True, env={**os.environ, **SOFTWARE_RENDERING})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) * 1e3


def million_particles(island: Path, folder: Path) -> Path:
    """The baked island whose only particles are a swarm of a million."""
    folder.mkdir()
    for file in island.iterdir():
        (folder / file.name).symlink_to(file.resolve())
    scene = json.loads((folder / "scene.json").read_text())
    swarm = next(field for field in scene["particles"] if field["motion"] == "swarm")
    scene["particles"] = [swarm | {"count": 1_000_000}]
    (folder / "scene.json").unlink()
    (folder / "scene.json").write_text(json.dumps(scene))
    return folder


def late_row(what: str, scene: Path, runs: int) -> Row:
    """The flight's last second beside its first: nothing is simulated up to there."""
    loaded_ms(scene, 239), loaded_ms(scene, 0)  # compile the shaders
    turns = [(loaded_ms(scene, 239), loaded_ms(scene, 0)) for _ in range(runs)]
    late_ms, first_ms = (statistics.median(turn[i] for turn in turns) for i in (0, 1))
    return Row(
        f"{what}, load and a frame at second 239", late_ms, "the same at second 0", first_ms, "-", "-",
        1 / 1.2, inside="processor time of a process, 160 x 90", ours_on=on(CORES), peer_on=on(CORES),
    )  # fmt: skip


def crowd_rows(runs: int, folder: Path) -> Iterator[Row]:
    """A frame of each crowd beside one of the island, in turns, and the processor time of finding what it
    draws."""
    island = ROOT / "build/assets/island"
    yield late_row("a million particles", million_particles(island, folder / "particles"), runs)
    bare = write_crowd(island, folder / "no_palm")
    crowds = {
        "1 palm": {"palms": 1},
        "100 palms": {"palms": 100},
        "2,000 palms": {"palms": 2000},
        "100,000 stones": {"stones": 100_000},
    }
    for name, count in crowds.items():
        scene = write_crowd(island, folder / name.replace(" ", "_"), **count)
        turns = [(drawn(scene, 5), drawn(island, 5)) for _ in range(min(runs, 3))]
        frame_ms, island_ms = (statistics.median(turn[i]["frame_ms"] for turn in turns) for i in (0, 1))
        scene_ms, plain_ms = (statistics.median(turn[i]["scene_ms"] for turn in turns) for i in (0, 1))
        calls = [turn["most_draw_calls"] for turn in turns[0]]
        inside = f"160 x 90, second 75, all resident; at most {calls[0]} draw calls, the island {calls[1]}"
        on_device = "the software rasteriser's threads"
        yield Row(
            f"{name} on the island, a frame", frame_ms, "the island's frame", island_ms, "-", "-",
            inside=inside, ours_on=on_device, peer_on=on_device,
        )  # fmt: skip
        yield Row(
            f"{name}, finding what to draw", scene_ms, "the island's", plain_ms, "-", "-",
            inside="processor time of culling, levels of detail, the terrain's cut, lists of draw calls",
            ours_on=on(1), peer_on=on(1),
        )  # fmt: skip
        if name == "2,000 palms":
            alone = write_crowd(island, folder / "alone", **count, alone=True)
            counts = [
                [drawn(at, 5, second)["most_draw_calls"] for at in (alone, scene, bare)] for second in MOMENTS
            ]
            most, with_others = (max(of[k] for of in counts) for k in (0, 1))
            added = max(of[1] - of[2] for of in counts)
            moments = (
                f"160 x 90, all resident, seconds {MOMENTS}, no other objects; beside the island's 19 kinds"
                f" of them they add at most {added} to a frame, which has at most {with_others}"
            )
            for what, ours, limit, unit, where in (
                ("most draw calls", most, 60, "", moments),
                ("finding", scene_ms, 0.5, "ms", inside),
            ):
                yield Row(
                    f"{name}, {what} of a frame", ours, "the limit", limit, "-", "-", 1.0, unit,
                    inside=where, ours_on=on(1), peer_on="-",
                )  # fmt: skip
        if name == "100,000 stones":
            yield late_row(name, scene, runs)
