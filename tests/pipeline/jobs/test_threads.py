"""-j of mesh, maps and terrain: how many threads the native kernels use, and that no byte depends on it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from paradize.build.single_file import BakedFiles, map_files, mesh_files, occlusion_files, terrain_files
from paradize.cli import main as cli
from paradize.jobs.limits import cores
from paradize.jobs.pool import Job, Outcome, run_jobs
from paradize.kernels.threads import VARIABLE, default_threads
from paradize.scene.baker_settings import MapSettings, MeshSettings, OcclusionSettings, TerrainSettings
from tests.pipeline.scenes import make_cove
from tests.pipeline.shapes import CORNER_OBJ
from tests.pipeline.worker_jobs import blas_threads, threads_of_kernels
from tests.sweeps import sample


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_cove(tmp_path_factory.mktemp("cove")).parent
    (folder / "corner.obj").write_text(CORNER_OBJ)
    return folder


@pytest.mark.parametrize("threads", [1, 5])
def test_kernels_in_a_worker_use_the_threads_that_it_was_given(threads: int) -> None:
    (outcome,) = run_jobs([Job("threads", threads_of_kernels, {})], 1, threads=threads)
    assert outcome.value == [threads] * 3


@pytest.mark.parametrize("word", ["", "0", "-3", "many", "\N{SUPERSCRIPT TWO}"])
def test_a_variable_that_is_no_count_leaves_it_to_the_machine(
    monkeypatch: pytest.MonkeyPatch, word: str
) -> None:
    monkeypatch.setenv(VARIABLE, word)
    assert default_threads(2) == min(2, os.cpu_count() or 1)


@pytest.mark.parametrize(("given", "expected"), [(None, "1"), ("3", "3")])
def test_numpy_in_a_worker_starts_no_threads_for_products_unless_asked(
    monkeypatch: pytest.MonkeyPatch, given: str | None, expected: str
) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if given:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
    (outcome,) = run_jobs([Job("blas", blas_threads, {})], 1)
    assert outcome.value == expected


@pytest.mark.deep
def test_the_same_bytes_and_measures_with_any_number_of_threads(sources: Path) -> None:
    made = []
    for threads in (1, 5):
        jobs = [
            Job(
                "mesh",
                mesh_files,
                {
                    "path": sources / "post.obj",
                    "settings": MeshSettings(lods=2),
                    "tier": "balanced",
                },
            ),
            Job(
                "maps",
                map_files,
                {
                    "path": sources / "wood.png",
                    "settings": MapSettings(source="color", strength=5.0, wrap="repeat"),
                    "tier": "balanced",
                    "uv": sources / "post.obj",
                },
            ),
            Job(
                "occlusion",
                occlusion_files,
                {
                    "path": sources / "corner.obj",
                    "settings": OcclusionSettings(occlusion_px=32),
                    "tier": "balanced",
                },
            ),
            Job(
                "terrain",
                terrain_files,
                {
                    "path": sources / "height.png",
                    "settings": TerrainSettings(size_m=(20.0, 20.0), height_m=4.0, max_error_m=0.05),
                    "tier": "balanced",
                },
            ),
        ]
        found: list[tuple[dict[str, bytes], dict[str, Any]]] = []
        for outcome in run_jobs(jobs, 1, threads=threads):
            assert outcome.error is None and isinstance(outcome.value, BakedFiles)
            outcome.value.report.pop("seconds", None)
            found.append((outcome.value.files, outcome.value.report))
        made.append(found)
    assert len(made[0][1][0]) == 4  # maps
    assert made[0] == made[1]


@pytest.mark.parametrize(
    ("words", "threads"),
    sample(
        [(["-j", "1"], 1), (["-j", "4096"], min(4096, cores())), ([], None)], every=2
    ),  # None: as run_jobs says
)
def test_j_is_the_number_of_threads_of_the_one_worker(
    sources: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], threads: int | None
) -> None:
    calls: list[tuple[int, int | None]] = []

    def spy(jobs: list[Job], count: int, *, threads: int | None, **_: object) -> list[Outcome]:
        calls.append((count, threads))
        return run_jobs(jobs, count, threads=threads)

    monkeypatch.setattr("paradize.jobs.pool.run_jobs", spy)
    out = str(tmp_path / "a.glb")
    size = ["--size", "20", "20", "--height", "4"]
    assert cli.main(["terrain", str(sources / "height.png"), "-o", out, *size, *words]) == 0
    assert calls == [(1, threads)]
