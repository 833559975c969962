"""What the engine costs when there is nothing to do."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from row import Row, median_ms
from tests.places import ROOT


def bench_no_op(runs: int) -> Row:
    scene, out = ROOT / "raw_assets/island.toml", ROOT / "build/assets/island"
    command = [str(ROOT / "build/venv/bin/paradize"), "bake", str(scene), "-o", str(out), "--json"]
    first = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    python = [sys.executable, "-c", "pass"]
    times = (
        median_ms(lambda: subprocess.run(command, capture_output=True, check=True), runs),
        median_ms(lambda: subprocess.run(python, check=True), runs),
    )
    reused = f"{len(first['artifacts'])} artifacts kept"
    return Row("island, nothing changed", times[0], "python -c pass", times[1], reused, "-")


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield bench_no_op(runs)
