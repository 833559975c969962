"""The cost of the engine beside the work: nothing to do, one map to do, stages that do nothing."""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from paradize.jobs.pool import Job, run_jobs
from row import CORES, Row, on, pair_ms
from tests.places import ROOT

STAGES = 200
# The tasks of an object's maps and what is measured of them, alone: no scene published, no record kept,
# nothing else looked at. The mesh is the one that was published.
ALONE = """
import sys, tempfile
from dataclasses import replace
from pathlib import Path
from paradize.build.bake import derive
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.measurements.object_measurements import measure_objects
from paradize.build.manifest import mesh_facts
from paradize.build.options import BuildOptions
from paradize.jobs.process import WorkerPool
from paradize.store.local import Store, hash_file
from paradize.scene.flight import plan_flight
from paradize.scene.sightings import object_sightings
from paradize.scene.settings import load_scene

path, owner, mesh, names = Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]), set(sys.argv[4:])
with tempfile.TemporaryDirectory() as name:
    store, options = Store(Path(name)), BuildOptions(jobs=2, pool=WorkerPool())
    made, errors = derive(store, path, names, options)
    assert not errors and set(made) == names, (made, errors)
    scene = load_scene(path)
    scene = replace(scene, objects=tuple(item for item in scene.objects if item.name == owner))
    facts = mesh_facts(mesh.read_bytes(), mesh.name)
    bounds = {owner: (facts.center, facts.radius_m)}
    sightings = object_sightings(scene, plan_flight(scene.flight), bounds)
    data = {one: store.find(sha256) for one, sha256 in made.items()} | {f"{owner}_mesh": mesh}
    hashes = made | {f"{owner}_mesh": hash_file(mesh)}
    maps = find_map_sets(scene, path).maps
    found, errors = measure_objects(store, scene, maps, sightings, data, hashes, options)
    options.pool.stop()
assert not errors and all((owner, owner) in of for of in found.values()), (found, errors)
"""


def bake_command(scene: Path, out: Path, *more: str) -> list[str]:
    return [str(ROOT / "build/venv/bin/paradize"), "bake", str(scene), "-o", str(out), "--json", *more]


def bake_report(command: list[str], store: Path, **more: str) -> dict[str, Any]:
    """The output of a bake without contact sheets. more: of its environment."""
    environment = {**os.environ, "PARADIZE_STORE": str(store), "PARADIZE_REPORT": "", **more}
    done = subprocess.run(command, capture_output=True, check=True, env=environment)
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def bench_no_op(runs: int, folder: Path) -> Row:
    command = bake_command(ROOT / "raw_assets/island.toml", folder / "island")
    first = bake_report(command, folder / "store")
    # Files younger than two seconds are read again (store/file_hashes.py): the row is of those at rest.
    began = time.monotonic()
    while time.monotonic() - began < 3.0:
        bake_report(command, folder / "store")
    python = [sys.executable, "-c", "pass"]
    times = pair_ms(
        lambda: bake_report(command, folder / "store"), lambda: subprocess.run(python, check=True), 3 * runs
    )
    kept = f"{len(first['artifacts'])} artifacts kept"
    return Row(
        "island, nothing changed",
        times[0],
        "python -c pass",
        times[1],
        kept,
        "-",
        1 / 8,
        inside="a process from its start to its end",
        ours_on=on(1),
        peer_on=on(1),
    )


def inverted(picture: Path, run: int) -> None:
    """A quarter of a PPM's texels, from elsewhere in each run, are what they were not."""
    data = bytearray(picture.read_bytes())
    quarter = len(data) // 4
    start = quarter + run * 3000
    data[start : start + quarter] = data[start : start + quarter].translate(bytes(range(255, -1, -1)))
    picture.write_bytes(data)


def bench_one_map(runs: int, folder: Path) -> Row:
    """A quarter of the palm's picture changes, so that its maps, their gutters and the normals that they show
    are new: a whole bake beside the baking and measuring of those alone, each a new process."""
    sources = folder / "sources"
    shutil.copytree(ROOT / "raw_assets", sources, dirs_exist_ok=True)
    picture, scene = sources / "palm/palm.ppm", sources / "island.toml"
    command = bake_command(scene, folder / "changed", "-j", "2")
    known = {row["name"]: row for row in bake_report(command, folder / "store")["artifacts"]}
    maps = [name for name in known if name.startswith("palm_") and name != "palm_mesh"]
    mesh = folder / "changed" / known["palm_mesh"]["file"]
    alone = [sys.executable, "-c", ALONE, str(scene), "palm", str(mesh), *maps]
    times: tuple[list[float], list[float]] = ([], [])
    for run in range(runs):
        inverted(picture, run)
        start = time.perf_counter()
        report = bake_report(command, folder / "store")
        times[0].append((time.perf_counter() - start) * 1e3)
        baked = {row["name"] for row in report["artifacts"] if row["status"] == "baked"}
        assert baked == set(maps), baked
        start = time.perf_counter()
        subprocess.run(alone, check=True)
        times[1].append((time.perf_counter() - start) * 1e3)
    ours, peer = map(statistics.median, times)
    what = f"baked and measured: {', '.join(maps)}"
    return Row(
        "island, one colour map changed",
        ours,
        "those maps alone",
        peer,
        what,
        "-",
        1 / 1.2,
        inside="a process from its start to its end, two workers",
        ours_on=on(CORES),
        peer_on=on(CORES),
    )


def bench_overhead(runs: int) -> Row:
    """Jobs that do nothing, in one worker, its start included, beside processes that do nothing."""
    jobs = [Job(f"nothing {i}", os.getpid, {}) for i in range(STAGES)]

    def ours() -> None:
        assert not [outcome.error for outcome in run_jobs(jobs, 1) if outcome.error]

    def peer() -> None:
        for _ in range(STAGES):
            subprocess.run([sys.executable, "-c", "pass"], check=True)

    times = pair_ms(ours, peer, max(1, runs // 3))
    return Row(
        f"{STAGES} stages that do nothing", times[0], f"python -c pass, {STAGES} times", times[1], "-", "-",
        2,
        inside="processes from their start to their end", ours_on=on(1), peer_on=on(1),
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield bench_no_op(runs, folder)
    yield bench_one_map(runs, folder)
    yield bench_overhead(runs)
