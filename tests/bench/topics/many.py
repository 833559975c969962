"""Many instances in a frame of the player; many assets in a scene: ten thousand of which nothing changed, two
hundred with two workers."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from crowds import crowd_rows
from many import PER_OBJECT, make_many
from row import Row, on, pair_ms
from tests.places import ROOT
from topics.engine import bake_command, bake_report

MANY = 10_000
SOME = 200
KEPT = ROOT / "build/bench"  # the scene, its store and its baked folder are kept from run to run
LOOK = "import os, sys; [os.stat(name) for name in sys.stdin.read().split(chr(0))]"
BURN = "x = 0\nfor i in range(40_000_000): x += i"


def bench_many(runs: int) -> Row:
    scene, out = KEPT / "many/many.toml", KEPT / "many-baked"
    if not scene.is_file():
        make_many(scene.parent, MANY // PER_OBJECT)
    command = bake_command(scene, out)
    for _ in range(2):  # the first bake takes minutes; the second reads once more what was new to the first
        count = len(bake_report(command, KEPT / "store")["artifacts"])
    files = "\0".join(map(str, [*scene.parent.rglob("*"), *out.iterdir()]))

    def ours() -> None:
        assert bake_report(command, KEPT / "store")["reused"] == count >= MANY

    def peer() -> None:
        subprocess.run([sys.executable, "-c", LOOK], input=files, text=True, check=True)

    times = pair_ms(ours, peer, runs)
    what = f"a process that asks for the state of its {files.count(chr(0)) + 1} files"
    return Row(
        f"{count} artifacts, nothing changed", times[0], what, times[1], "-", "-", 1 / 10,
        inside="a process from its start to its end", ours_on=on(1), peer_on=on(1),
    )  # fmt: skip


def burnt_s(processes: int) -> float:
    """Seconds until that many processes at once have burnt what each has to."""
    start = time.perf_counter()
    running = [subprocess.Popen([sys.executable, "-c", BURN]) for _ in range(processes)]
    assert not any(process.wait() for process in running)
    return time.perf_counter() - start


def bench_two_workers(runs: int, folder: Path) -> Row:
    """The same bake with one worker and with two, a thread each; beside it what two processes gain here."""
    scene = make_many(folder / "some", SOME // PER_OBJECT, side=512)
    times: dict[int, list[float]] = {1: [], 2: []}
    burns: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(min(runs, 3)):
        for workers in (1, 2):
            command = bake_command(scene, folder / f"some-{workers}", "--force", "-j", str(workers))
            start = time.perf_counter()
            report = bake_report(command, folder / "some-store", PARADIZE_THREADS="1")
            times[workers].append((time.perf_counter() - start) * 1e3)
            assert report["baked"] == len(report["artifacts"]) > SOME
            burns[workers].append(burnt_s(workers))
    one, two = statistics.median(times[1]), statistics.median(times[2])
    machine = 2 * statistics.median(burns[1]) / statistics.median(burns[2])
    gain = f"two processes do {machine:.2f} x one's work on this machine now"
    return Row(
        f"{SOME} assets, two workers",
        two,
        "one worker",
        one,
        gain,
        "-",
        1.7,
        inside="a whole bake, the process's start included",
        ours_on="2 processes of " + on(1),
        peer_on="1 process of " + on(1),
    )


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield from crowd_rows(runs, folder)
    yield bench_many(runs)
    yield bench_two_workers(runs, folder)
