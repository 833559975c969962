"""The same bytes for any number of workers, in any order, from a cold store and a warm one, with a thread or
many. (Other processors: tests/pipeline/kernels/test_lesser_processors.py; kills: test_kills.py.)"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from paradize.build import work
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.jobs.pool import Job, Outcome, run_jobs
from tests.pipeline.build.changing_scenes import cove, few_of_a_gallery, whole_gallery
from tests.pipeline.small_scenes import make_post

Bytes = dict[str, bytes]


SCENES = {"cove": cove, "few": few_of_a_gallery, "gallery": whole_gallery}


@pytest.fixture(scope="module")
def first_bake(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Path, Bytes]]:
    """By its name a scene, and its files by one worker with one thread from a cold store. Each is baked once
    (a fixture with these parameters would be for each test)."""

    @cache
    def made(name: str) -> tuple[Path, Bytes]:
        top = tmp_path_factory.mktemp(name)
        scene = SCENES[name](top / "scene")[0]
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("PARADIZE_STORE", str(top / "store"))
            patch.setenv("PARADIZE_THREADS", "1")
            assert not bake(scene, top / "out", BuildOptions(jobs=1)).errors
        return scene, {path.name: path.read_bytes() for path in (top / "out").iterdir()}

    return made


@pytest.fixture
def first(
    request: pytest.FixtureRequest, first_bake: Callable[[str], tuple[Path, Bytes]]
) -> tuple[Path, Bytes]:
    return first_bake(request.param)


@pytest.fixture
def truth(first: tuple[Path, Bytes]) -> Bytes:
    return first[1]


@pytest.fixture
def baked(first: tuple[Path, Bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Bytes]:
    """Bakes the scene into a new folder; all its files."""

    def call(name: str, jobs: int, *, store: str, force: bool = False, threads: int = 3) -> Bytes:
        monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / store))
        monkeypatch.setenv("PARADIZE_THREADS", str(threads))
        report = bake(first[0], tmp_path / name, BuildOptions(jobs=jobs, force=force))
        assert not report.errors, report.errors
        return {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()}

    return call


@pytest.mark.parametrize(
    ("first", "jobs", "threads"),
    [(scene, *many) for scene in SCENES for many in ((2, 1), (2, 3), (4, 3))],
    indirect=["first"],
)
@pytest.mark.deep  # two workers with three threads each: below
def test_any_number_of_workers_and_threads(
    baked: Callable[..., Bytes], truth: Bytes, jobs: int, threads: int
) -> None:
    assert baked("out", jobs, store="store", threads=threads) == truth


@pytest.mark.parametrize("first", SCENES, indirect=True)
@pytest.mark.deep  # a forced bake by several is in the next test
def test_a_warm_store_and_a_forced_bake(baked: Callable[..., Bytes], truth: Bytes) -> None:
    assert baked("cold", 2, store="one") == truth
    assert baked("warm", 2, store="one") == truth
    assert baked("forced", 2, store="one", force=True) == truth


def test_two_workers_with_three_threads_bake_anew_as_one_worker_did(
    tmp_path: Path, cove_store: Callable[[Path], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = cove(tmp_path / "scene")[0]
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    assert not bake(scene, tmp_path / "one", BuildOptions(jobs=1)).count("baked")
    monkeypatch.setenv("PARADIZE_THREADS", "3")
    assert bake(scene, tmp_path / "two", BuildOptions(jobs=2, force=True)).count("baked") == 14
    one, two = (
        {path.name: path.read_bytes() for path in (tmp_path / out).iterdir()} for out in ("one", "two")
    )
    assert one == two


def test_a_copy_of_a_model_under_another_name_changes_no_bytes_of_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file holds its source's name: what was baked of the copy is not taken for the other."""
    scene = make_post(tmp_path / "scene")
    (scene.parent / "copy.obj").write_bytes((scene.parent / "post.obj").read_bytes())
    text = scene.read_text().replace("lods = 3", "lods = 1")
    made = []
    for name, store in (("post", "own"), ("copy", "shared"), ("post", "shared"), ("copy", "shared")):
        scene.write_text(text.replace('mesh = "post.obj"', f'mesh = "{name}.obj"'))
        monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / store))
        out = tmp_path / f"out{len(made)}"
        assert not bake(scene, out, BuildOptions(jobs=1)).errors
        made.append({path.name: path.read_bytes() for path in out.iterdir()})
    assert made[0] == made[2] and made[1] == made[3] and made[0] != made[1]


@pytest.mark.parametrize(
    ("first", "seed"),
    [(scene, seed) for scene in SCENES for seed in (1, 2)],
    indirect=["first"],
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
