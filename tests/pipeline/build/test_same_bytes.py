"""The same bytes for any number of workers, in any order, from a cold store and a warm one, with a thread or
many. (Other processors: tests/pipeline/kernels/test_lesser_processors.py; kills: test_kills.py.)"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from paradize.build import work
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.jobs.pool import Job, Outcome, run_jobs
from tests.pipeline.build.changing_scenes import cove, few_of_a_gallery, whole_gallery
from tests.pipeline.material_scene import make_panels
from tests.sweeps import sweep

Bytes = dict[str, bytes]


SCENES = {"cove": cove, "few": few_of_a_gallery, "gallery": whole_gallery}


@pytest.fixture(scope="module")
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return SCENES[request.param](tmp_path_factory.mktemp(request.param) / "scene")[0]


@pytest.fixture
def baked(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Bytes]:
    """Bakes the scene into a new folder; all its files."""

    def call(name: str, jobs: int, *, store: str, force: bool = False, threads: int = 1) -> Bytes:
        monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / store))
        monkeypatch.setenv("PARADIZE_THREADS", str(threads))
        report = bake(scene, tmp_path / name, BuildOptions(jobs=jobs, force=force))
        assert not report.errors, report.errors
        return {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()}

    return call


@pytest.fixture(scope="module")
def truth(scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Bytes:
    """One worker, one thread, a cold store."""
    top = tmp_path_factory.mktemp("truth")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(top / "store"))
        patch.setenv("PARADIZE_THREADS", "1")
        assert not bake(scene, top / "out", BuildOptions(jobs=1)).errors
    return {path.name: path.read_bytes() for path in (top / "out").iterdir()}


@pytest.mark.parametrize(
    ("scene", "jobs", "threads"),
    sweep(
        [(scene, *many) for scene in SCENES for many in ((2, 1), (4, 3))],
        test=[("cove", 4, 3)],
    ),
    indirect=["scene"],
)
def test_any_number_of_workers_and_threads(
    baked: Callable[..., Bytes], truth: Bytes, jobs: int, threads: int
) -> None:
    assert baked("out", jobs, store="store", threads=threads) == truth


@pytest.mark.parametrize("scene", sweep(SCENES, test=["cove"]), indirect=True)
def test_a_warm_store_and_a_forced_bake(baked: Callable[..., Bytes], truth: Bytes) -> None:
    assert baked("cold", 2, store="one") == truth
    assert baked("warm", 2, store="one") == truth
    assert baked("forced", 2, store="one", force=True) == truth


def test_a_copy_of_a_model_under_another_name_changes_no_bytes_of_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file holds its source's name: what was baked of the copy is not taken for the other."""
    scene = make_panels(tmp_path / "scene")
    (scene.parent / "copy.obj").write_bytes((scene.parent / "panel.obj").read_bytes())
    text = scene.read_text()
    made = {}
    for name in ("copy", "panel"):
        scene.write_text(text.replace('mesh = "panel.obj"', f'mesh = "{name}.obj"'))
        for store in ("shared", name):
            monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / store))
            out = tmp_path / f"{name}_{store}"
            assert not bake(scene, out, BuildOptions(jobs=1)).errors
            made[name, store == "shared"] = {path.name: path.read_bytes() for path in out.iterdir()}
    for name in ("copy", "panel"):
        assert made[name, True] == made[name, False]


@pytest.mark.parametrize(
    ("scene", "seed"),
    [(scene, seed) for scene in SCENES for seed in (1, 2)],
    indirect=["scene"],
)
@pytest.mark.deep  # workers that end in any order are in `make test`
def test_any_order_of_the_jobs(
    baked: Callable[..., Bytes], truth: Bytes, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    shuffled: list[str] = []

    def run(jobs: Sequence[Job], *rest: Any, **more: Any) -> list[Outcome]:
        order = list(jobs)
        random.Random(seed).shuffle(order)
        shuffled.extend(job.name for job in order)
        found = {outcome.name: outcome for outcome in run_jobs(order, *rest, **more)}
        return [found[job.name] for job in jobs]

    monkeypatch.setattr(work, "run_jobs", run)
    assert baked("out", 2, store="store") == truth
    assert len(shuffled) > 8
