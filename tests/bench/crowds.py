"""Frames of many instances on the baked island."""

from __future__ import annotations

import json
import statistics
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from row import Row, on
from tests.made.crowd import write_crowd
from tests.places import ROOT


def drawn(folder: Path, frames: int) -> dict[str, Any]:
    """The output of --json for some frames at second 75, where half of the island is in view."""
    player = ROOT / "build/bin/paradize-player"
    command = [player, folder, "--headless", "--wait-resident", "--time", "75", "--frames", str(frames)]
    command += ["--size", "160x90", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout))


def crowd_rows(runs: int, folder: Path) -> Iterator[Row]:
    """A frame of each crowd beside one of the island, in turns, and the processor time of finding what it
    draws."""
    island = ROOT / "build/assets/island"
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
            for what, ours, most, unit in (
                ("most draw calls", calls[0], 60, ""),
                ("finding", scene_ms, 0.5, "ms"),
            ):
                yield Row(
                    f"{name}, {what} of a frame", ours, "the limit", most, "-", "-", 1.0, unit,
                    inside=inside, ours_on=on(1), peer_on="-",
                )  # fmt: skip
