"""A job that crashes, hangs or eats memory is stopped, tried once more, and spoils no other job."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers import registry
from paradize.build.bake import bake
from paradize.build.estimate import memory_of
from paradize.build.options import BuildOptions
from paradize.errors import BakeError, SourceError, unexpected
from paradize.jobs.limits import available, cores, memory_limit, process_memory, time_limit
from paradize.jobs.pool import Job, Outcome, WorkerPool, run_jobs
from paradize.jobs.scratch import Scratch
from paradize.kernels.threads import VARIABLE as THREADS
from tests.pipeline.scenes import make_cove, write_image
from tests.pipeline.worker_jobs import (
    allocate,
    alone,
    climb,
    crash,
    crash_on,
    double,
    eat,
    eat_beside,
    hang,
    hunger_on,
    leave_files,
    meet,
    open_too_many,
    stop_in_an_answer,
    tell_process,
    tell_threads,
    unsendable,
)
from tests.processes import started
from tests.sweeps import sweep

MB = 1_000_000


class HangingJob(Job):
    """A call of `hang` that may take a second once it hangs: until then a busy machine has all the time."""

    @property
    def most_s(self) -> float:
        hangs = self.arguments["tally"].with_suffix(".hangs")
        try:
            os.kill(int(hangs.read_text()), 0)
        except (FileNotFoundError, ValueError, ProcessLookupError):
            return 600.0
        return 1.0


def run_beside(*jobs: Job, workers: int = 2) -> list[Outcome]:
    """The outcomes of the jobs between two good ones, which must be good."""
    good = [Job("good one", double, {"value": 1}), Job("good two", double, {"value": 2})]
    first, *found, last = run_jobs([good[0], *jobs, good[1]], workers)
    assert (first.value, first.error, last.value, last.error) == (2, None, 4, None)
    return found


def test_jobs_of_one_name_are_refused() -> None:
    """Their outcomes are found by name: one would stand for both."""
    jobs = [Job("a", os.getpid, {}), Job("b", os.getpid, {}), Job("a", os.getpid, {})]
    with pytest.raises(ValueError, match="several jobs are named 'a'"):
        run_jobs(jobs, 1)


def test_modules_in_the_folder_where_a_bake_runs_are_not_taken_for_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("json", "numpy", "random", "struct"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('own')\n")
    monkeypatch.chdir(tmp_path)
    (outcome,) = run_jobs([Job("a", double, {"value": 2})], 1)
    assert (outcome.value, outcome.error) == (4, None)


def test_a_crew_that_is_kept_serves_the_next_call(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(THREADS, raising=False)
    pool = WorkerPool()
    try:

        def worker_of(threads: int) -> tuple[int, str | None]:
            (outcome,) = run_jobs([Job("job", tell_process, {})], 1, threads=threads, pool=pool)
            assert outcome.error is None
            found: tuple[int, str | None] = outcome.value
            return found

        first = worker_of(3)
        assert first[1] == "3" and worker_of(3) == first
        other = worker_of(1)
        assert other[0] != first[0] and other[1] == "1" and worker_of(3) == first
        assert {worker_of(2)[0]}.isdisjoint((first[0], other[0])) and len(pool.workers) == 2
        pool.workers[-1].process.kill()
        pool.workers[-1].process.wait()
        assert worker_of(2)[1] == "2"
    finally:
        pool.stop()
    assert pool.workers == []


def test_an_interrupted_call_leaves_no_worker_at_work(tmp_path: Path) -> None:
    pool = WorkerPool()

    def interrupt(outcome: Outcome) -> None:
        raise KeyboardInterrupt

    jobs = [Job("hangs", hang, {"tally": tmp_path / "tally", "times": 1}), Job("ends", tell_process, {})]
    with pytest.raises(KeyboardInterrupt):
        run_jobs(jobs, 2, interrupt, pool=pool)
    assert pool.workers == []


@pytest.mark.parametrize("workers", sweep([1, 2], test=[2]))
def test_a_crash_is_tried_once_more(tmp_path: Path, workers: int) -> None:
    jobs = [
        Job(f"crash {times}", crash, {"tally": tmp_path / str(times), "times": times}, file="palm.obj")
        for times in (1, 9)
    ]
    once, always = run_beside(*jobs, workers=workers)
    assert (once.value, once.error, once.tries) == ("survived", None, 2)
    assert str(always.error).startswith("palm.obj: crash 9 could not be baked: its process crashed (SIGSEGV)")
    assert "twice" in str(always.error) and (tmp_path / "9").read_text() == "xx"


def test_a_worker_that_something_else_kills_is_not_told_to_be_the_inputs_fault(tmp_path: Path) -> None:
    (found,) = run_beside(Job("dies", crash, {"tally": tmp_path / "x", "times": 9, "number": signal.SIGKILL}))
    assert "killed from outside (SIGKILL), twice; the machine may lack memory" in str(found.error)


def test_a_limit_of_the_machine_is_not_told_as_an_internal_error(tmp_path: Path) -> None:
    (found,) = run_beside(Job("opens", open_too_many, {}, file="palm.obj"))
    assert str(found.error) == "palm.obj: too many open files; allow more: `ulimit -n 1024`"
    for error in (MemoryError(), BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")):
        assert "allow more (`ulimit -a`)" in str(unexpected(error))
    assert "internal error: ValueError: x (in a.py); please report it" in str(
        unexpected(ValueError("x"), " (in a.py)")
    )


def test_a_worker_that_is_killed_leaves_no_temporary_files(tmp_path: Path) -> None:
    (found,) = run_beside(Job("leaves", leave_files, {"tally": tmp_path / "tally"}))
    assert found.error is not None
    assert not Path((tmp_path / "tally").read_text()).exists()


def test_what_a_killed_parent_leaves_is_swept_by_the_next_and_what_is_at_work_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    make = "from paradize.jobs.scratch import Scratch; s = Scratch(); print(s.path, flush=True); "
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    command = [sys.executable, "-c", make + "import signal; signal.pause()"]
    with started(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        left = Path(process.stdout.readline().strip())
        beside = Scratch()
        assert left.is_dir()
        process.kill()
        process.wait()
        assert left.is_dir()
        again = Scratch()
        assert not left.exists() and beside.path.is_dir() and again.path.is_dir()
    beside.remove()
    again.remove()
    assert not list(tmp_path.iterdir())


def test_a_hang_is_killed_and_tried_once_more(tmp_path: Path) -> None:
    jobs = [
        HangingJob(f"hang {times}", hang, {"tally": tmp_path / str(times), "times": times}, file="palm.obj")
        for times in (1, 9)
    ]
    once, always = run_beside(*jobs)
    assert (once.value, once.error, once.tries) == ("woke", None, 2)
    assert str(always.error).startswith("palm.obj: hang 9 took longer than 1 s, twice; where it only needs")
    assert "$PARADIZE_TIMEOUT" in str(always.error)
    assert (tmp_path / "9").read_text() == "xx"


def test_large_inputs_may_take_longer_than_half_an_hour(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PARADIZE_TIMEOUT", raising=False)
    assert (time_limit(10.0), time_limit(5000.0)) == (1800.0, 5000.0)
    monkeypatch.setenv("PARADIZE_TIMEOUT", "60")
    assert time_limit(5000.0) == 60.0


def test_how_long_a_job_may_take_is_a_setting(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert time_limit() == 1800 == time_limit(900) and time_limit(7200) == 7200
    monkeypatch.setenv("PARADIZE_TIMEOUT", "0.5")
    (hung,) = run_jobs([Job("hang", hang, {"tally": tmp_path / "tally", "times": 9})], 1)
    assert "took longer than 0.5 s, twice" in str(hung.error)
    for result in ("0", "-1", "soon", "1e400", "nan"):
        monkeypatch.setenv("PARADIZE_TIMEOUT", result)
        with pytest.raises(BakeError, match="expected seconds above 0"):
            run_jobs([Job("a", double, {"value": 1})], 1)


def test_a_pool_leaves_no_worker_behind() -> None:
    with WorkerPool() as pool:
        run_jobs([Job("a", double, {"value": 1})], 1, pool=pool)
        (worker,) = pool.workers
        assert worker.process.poll() is None
    assert worker.process.poll() is not None and not pool.workers


def test_how_many_jobs_run_at_once_is_a_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PARADIZE_JOBS", raising=False)
    assert BuildOptions().workers == cores()
    monkeypatch.setenv("PARADIZE_JOBS", "3")
    assert (BuildOptions().workers, BuildOptions(jobs=2).workers) == (3, 2)
    for said in ("0", "-1", "many", "1.5", "99999"):
        monkeypatch.setenv("PARADIZE_JOBS", said)
        with pytest.raises(BakeError, match="expected a whole number from 1 to 9999"):
            _ = BuildOptions().workers


@pytest.mark.deep
def test_a_worker_that_stops_in_the_middle_of_an_answer_holds_up_nobody() -> None:
    (stopped,) = run_beside(Job("half", stop_in_an_answer, {}, 1.0), workers=1)
    assert "took longer than 1 s, twice" in str(stopped.error)


def test_what_cannot_be_sent_back_is_an_error_of_its_job() -> None:
    (outcome,) = run_beside(Job("lambda", unsendable, {}), workers=1)
    assert "cannot be sent" in str(outcome.error) and outcome.tries == 1


def test_a_worker_allocates_no_more_than_there_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_MEMORY", "1G")
    (outcome,) = run_beside(Job("huge", allocate, {"amount": 2000 * MB}, file="huge.png"))
    assert isinstance(outcome.error, SourceError)
    assert str(outcome.error).startswith("huge.png: needs more memory than the limit")
    (outcome,) = run_beside(Job("large", allocate, {"amount": 300 * MB}))
    assert outcome.value == 300 * MB


def test_a_job_that_eats_memory_is_killed_at_the_limit(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PARADIZE_MEMORY", "300M")
    glutton = Job("glutton", eat, {"amount": 1000 * MB, "then": tmp_path / "full"}, file="huge.png")
    (outcome,) = run_beside(glutton)
    assert isinstance(outcome.error, BakeError) and not (tmp_path / "full").exists()
    assert str(outcome.error).startswith("huge.png: glutton needs more memory than the limit of 300 MB")


@pytest.mark.deep  # jobs wait until their estimates fit: below
def test_two_jobs_that_do_not_fit_together_both_succeed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Nothing was known of them: what must go beside the other comes again when it is alone."""
    monkeypatch.setenv("PARADIZE_MEMORY", "400M")
    for name in "ab":
        os.mkfifo(tmp_path / f"from {name}")
    result = {"amount": 260 * MB, "folder": tmp_path}
    outcomes = run_jobs([Job(name, eat_beside, result | {"name": name}) for name in "ab"], 2)
    assert [(outcome.value, outcome.error) for outcome in outcomes] == [(13, None)] * 2
    assert sorted(outcome.tries for outcome in outcomes) == [1, 2]


def test_jobs_wait_until_their_estimates_fit_and_one_may_always_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARADIZE_MEMORY", "1G")

    def answers(call: Callable[..., bool], sizes: tuple[int, int], *given: dict[str, Any]) -> list[Any]:
        jobs = [
            Job(str(k), call, arguments, timeout_s=300.0, memory_bytes=size * MB)
            for k, (size, arguments) in enumerate(zip(sizes, given, strict=True))
        ]
        return [outcome.value for outcome in run_jobs(jobs, 2)]

    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert answers(meet, (400, 400), *({"pipe": pipe, "mode": mode} for mode in "rw")) == [True, True]
    places = tmp_path / "places"
    places.mkdir()
    for sizes in ((700, 700), (5000, 100)):
        given = [{"own": places / name, "folder": places} for name in "ab"]
        assert answers(alone, sizes, *given) == [True, True]


@pytest.mark.parametrize("workers", [1, 2, 1000])
def test_each_worker_is_given_its_share_of_the_cores(monkeypatch: pytest.MonkeyPatch, workers: int) -> None:
    given: list[int | None] = []

    class Recorder:
        def __init__(self, *, threads: int | None, **more: Any) -> None:
            given.append(threads)

        def run(self) -> list[Outcome]:
            return []

        def busy(self) -> bool:
            return False

    monkeypatch.setattr("paradize.jobs.pool._Scheduler", Recorder)
    monkeypatch.delenv(THREADS, raising=False)
    run_jobs([], workers, pool=WorkerPool())
    monkeypatch.setenv(THREADS, "3")
    run_jobs([], workers, pool=WorkerPool())
    assert given == [max(1, cores() // workers), None]


@pytest.mark.deep
def test_cores_are_shared_out_among_the_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(THREADS, raising=False)
    for workers in (1, 2, 1000):
        outcome = run_jobs([Job("threads", tell_threads, {})], workers)[0]
        assert outcome.value == str(max(1, cores() // workers))
    monkeypatch.setenv(THREADS, "3")
    assert run_jobs([Job("threads", tell_threads, {})], 2)[0].value == "3"


@pytest.mark.parametrize(
    ("text", "expected"), [("4G", 4e9), ("500Mi", 500 * 2**20), ("1.5GB", 1.5e9), ("123456", 123456)]
)
def test_the_limit_is_told_in_bytes(monkeypatch: pytest.MonkeyPatch, text: str, expected: float) -> None:
    monkeypatch.setenv("PARADIZE_MEMORY", text)
    assert memory_limit() == int(expected)


def test_the_limit_may_be_a_share_of_what_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    free = available()
    assert free is not None and free > 100 * MB
    monkeypatch.setenv("PARADIZE_MEMORY", "50%")
    half = memory_limit()
    monkeypatch.delenv("PARADIZE_MEMORY")
    whole = memory_limit()
    assert half == pytest.approx(free / 2, rel=0.3) and whole == pytest.approx(0.8 * free, rel=0.3)


@pytest.mark.parametrize("text", ["much", "-3G", "0", "120%", "4 G", "\N{SUPERSCRIPT TWO}"])
def test_a_limit_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setenv("PARADIZE_MEMORY", text)
    with pytest.raises(BakeError, match="expected bytes or a share"):
        run_jobs([Job("a", double, {"value": 1})], 1)


def test_what_a_process_and_its_children_hold_is_measured() -> None:
    before = process_memory(os.getpid())
    held = np.ones(100 * MB, np.uint8)
    assert process_memory(os.getpid()) - before == pytest.approx(held.nbytes, rel=0.1)
    assert process_memory(2**30) == 0


def test_estimates_follow_the_sizes_in_the_headers(tmp_path: Path) -> None:
    base = memory_of([])
    for name in ("a.png", "a.jpg"):
        write_image(tmp_path / name, np.zeros((300, 500, 3), np.uint8))
        assert memory_of([tmp_path / name]) - base == 48 * 300 * 500
    (tmp_path / "a.obj").write_bytes(b"v 0 0 0\n" * 100)
    assert memory_of([tmp_path / "a.obj"]) - base == 12 * 800
    (tmp_path / "a.exr").write_bytes(b"?" * 1000)
    (tmp_path / "cut.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    (tmp_path / "cut.jpg").write_bytes(b"\xff\xd8\xff\xe0\x00")
    assert memory_of([tmp_path / "a.exr"]) - base == 48 * 1000
    assert memory_of([tmp_path / name for name in ("cut.png", "cut.jpg", "none.png")]) - base == 48 * 13


@pytest.mark.deep
@pytest.mark.parametrize("how", ["crash", "hunger"])
def test_in_a_scene_only_its_own_artifact_is_spoilt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    """A stage that misbehaves on one source; the others are baked, kept, and not baked again."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("PARADIZE_MEMORY", "600M")
    scene, out = make_cove(tmp_path / "scene"), tmp_path / "out"
    module, _ = registry.BAKERS["sound"]
    monkeypatch.setitem(registry.BAKERS, "sound", (module, crash_on if how == "crash" else hunger_on))
    report = bake(scene, out, BuildOptions(jobs=2))
    assert [row["name"] for row in report.rows if row["status"] == "failed"] == ["sound"]
    assert len(report.errors) == 1 and "sea.ogg: sound" in str(report.errors[0])
    assert not (out / "scene.json").exists()
    monkeypatch.undo()
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    mended = bake(scene, out, BuildOptions(jobs=2))
    assert [row["name"] for row in mended.rows if row["status"] == "baked"] == ["sound"]


def test_the_caller_hears_of_the_steps_of_each_job() -> None:
    heard: list[tuple[str, str]] = []
    jobs = [Job(name, climb, {"steps": count}) for name, count in (("a", 2), ("b", 1), ("c", 0))]
    outcomes = run_jobs(jobs, 1, on_step=lambda name, step: heard.append((name, step)))
    assert [outcome.value for outcome in outcomes] == [2, 1, 0]
    assert heard == [("a", "step 0"), ("a", "step 1"), ("b", "step 0")]
    assert [outcome.value for outcome in run_jobs(jobs, 1)] == [2, 1, 0]  # nobody has to listen
