"""The same bake on a Dask cluster: a real scheduler and real worker processes, some of which are killed."""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from paradize.bakers import registry
from paradize.build.bake import bake
from paradize.build.options import BuildOptions, JobObserver
from paradize.cluster import connection, dask_worker
from paradize.cluster import scheduler as cluster
from paradize.cluster.connection import ClusterLost
from paradize.cluster.scheduler import run_on_cluster
from paradize.errors import BakeError
from paradize.jobs.pool import Job, Outcome
from tests.pipeline.clusters import ROOT, Cluster, double, kill_worker, read, read_late, stall_once
from tests.pipeline.scenes import make_cove
from tests.pipeline.small_scenes import sky_and_sound, without_object
from tests.processes import started


@pytest.fixture(scope="module")
def started_clusters() -> Iterator[list[Cluster]]:
    """Clusters of this module, closed at its end."""
    made: list[Cluster] = []
    try:
        yield made
    finally:
        for one in made:
            one.close()


@pytest.fixture
def scheduler(started_clusters: list[Cluster], tmp_path_factory: pytest.TempPathFactory) -> Cluster:
    """A scheduler, which tests share. The first of them finds no workers."""
    if not started_clusters or not started_clusters[-1].listens():
        started_clusters.append(Cluster(tmp_path_factory.mktemp("standing")))
        started_clusters[-1].start(0)
    return started_clusters[-1]


@pytest.fixture
def standing(scheduler: Cluster) -> Cluster:
    """The scheduler with two workers, which tests share. What one of them killed is started again: they come
    last."""
    found = scheduler
    found.replace_workers()
    while len(found.workers) < 2:
        found.add_worker()
    found.fifo.with_suffix(".done").unlink(missing_ok=True)
    return found


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[[int], Cluster]]:
    """Makes one of a test's own."""
    (tmp_path / "own").mkdir()
    made = Cluster(tmp_path / "own")
    try:
        yield made.start
    finally:
        made.close()


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("PARADIZE_REPORT", "")


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@contextmanager
def killing_who_stalls(own: Cluster) -> Iterator[list[int]]:
    """Kills the Dask worker where `stall` runs; its number."""
    killed: list[int] = []

    def kill() -> None:
        killed.append(int(own.stalled_job().split()[0]))
        os.kill(killed[0], signal.SIGKILL)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    yield killed
    thread.join()


class Warned(JobObserver):
    def __init__(self) -> None:
        self.texts: list[str] = []

    def warned(self, text: str) -> None:
        self.texts.append(text)


def test_a_scheduler_without_workers_is_one_message(
    scheduler: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not scheduler.workers
    monkeypatch.setattr(cluster, "ABSENT_S", 0.5)
    outcomes = run_on_cluster(scheduler.address, [Job(name, double, {"value": 1}) for name in "ab"])
    (said,) = {str(outcome.error) for outcome in outcomes}
    assert "has had no worker for 0.5 s" in said and "dask worker" in said


def test_one_machine_and_a_cluster_give_the_same_bytes_of_ground_sky_and_sea(
    standing: Cluster, cove_store: Callable[[Path], Path], tmp_path: Path
) -> None:
    """The one machine baked them for the store."""
    cove_store(tmp_path / "store")
    scene = without_object(make_cove(tmp_path / "scene"))
    assert not bake(scene, tmp_path / "here", BuildOptions(jobs=1)).count("baked")
    there = bake(scene, tmp_path / "there", BuildOptions(force=True, cluster=standing.address))
    assert not there.errors and there.count("baked") == 9
    assert contents(tmp_path / "here") == contents(tmp_path / "there")


@pytest.mark.deep
def test_one_machine_and_a_cluster_give_the_same_bytes_and_say_the_same(
    standing: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The object's colour is what its material file names; its folder is spelled with a detour."""
    scene = make_cove(tmp_path / "scene")
    scene.write_text(scene.read_text().replace('color = "wood.png"\n', ""))
    (tmp_path / "scene" / "post.mtl").write_text("newmtl wood\nmap_Kd wood.png\nmap_Ks none.png\nKz 3\n")
    monkeypatch.chdir(tmp_path / "scene")
    spelled = Path("../scene/cove.toml")
    here = bake(spelled, tmp_path / "here", BuildOptions(jobs=1, force=True))
    observer = Warned()
    there = bake(
        spelled, tmp_path / "there", BuildOptions(force=True, cluster=standing.address, observer=observer)
    )
    assert not here.errors and not there.errors and not observer.texts
    assert contents(tmp_path / "here") == contents(tmp_path / "there")
    assert here.warnings == there.warnings and any("post.obj" in text for text in here.warnings)
    rows = [[{**row, "seconds": 0} for row in report.rows] for report in (here, there)]
    assert rows[0] == rows[1]


def test_a_bad_source_is_told_by_the_path_that_the_user_wrote(standing: Cluster, tmp_path: Path) -> None:
    scene = sky_and_sound(make_cove(tmp_path / "scene"))
    (scene.parent / "sea.ogg").write_bytes(b"no sound")
    here, there = (
        bake(scene, tmp_path / name, BuildOptions(cluster=at))
        for name, at in (("here", None), ("there", standing.address))
    )
    assert [str(error) for error in here.errors] == [str(error) for error in there.errors]
    assert str(scene.parent / "sea.ogg") in str(there.errors[0]) and len(there.errors) == 1
    assert not (tmp_path / "there").exists()


def test_each_file_travels_once(standing: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import distributed

    sent: list[int] = []
    scatter = distributed.Client.scatter

    def spy(self: object, data: bytes, **options: object) -> object:
        sent.append(len(data))
        return scatter(self, data, **options)

    monkeypatch.setattr(distributed.Client, "scatter", spy)
    large, small = tmp_path / "large", tmp_path / "small"
    large.write_bytes(os.urandom(3_000_000))
    small.write_bytes(b"small")
    files = dict.fromkeys((large, small), True)
    jobs = [Job(f"job {i}", read, {"paths": [large, small]}, files=files) for i in range(8)]
    outcomes = run_on_cluster(standing.address, jobs)
    assert sorted(sent) == [5, 3_000_000]
    assert all(outcome.value == [large.read_bytes(), b"small"] for outcome in outcomes)


@pytest.mark.deep
def test_a_worker_killed_in_mid_bake_costs_nothing_but_time(
    start: Callable[[int], Cluster], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, scene = start(2), make_cove(tmp_path / "scene")
    assert not bake(scene, tmp_path / "here", BuildOptions(jobs=1)).errors
    module, _ = registry.BAKERS["sound"]
    monkeypatch.setitem(registry.BAKERS, "sound", (module, stall_once))
    with killing_who_stalls(own) as killed:
        report = bake(scene, tmp_path / "there", BuildOptions(force=True, cluster=own.address))
    assert killed[0] in [worker.pid for worker in own.workers] and not report.errors
    assert contents(tmp_path / "here") == contents(tmp_path / "there")


@pytest.mark.deep
def test_a_job_that_kills_two_workers_is_told_and_kills_no_third(start: Callable[[int], Cluster]) -> None:
    own = start(3)
    jobs = [Job(f"good {i}", double, {"value": i}) for i in range(6)]
    jobs.insert(2, Job("killer", kill_worker, {}, file="palm.obj"))
    outcomes = {outcome.name: outcome for outcome in run_on_cluster(own.address, jobs)}
    assert str(outcomes["killer"].error).startswith("palm.obj: killer could not be baked: its worker")
    assert "twice" in str(outcomes.pop("killer").error)
    assert [outcome.value for outcome in outcomes.values()] == [0, 2, 4, 6, 8, 10]
    assert sorted(worker.poll() is None for worker in own.workers) == [False, False, True]


def test_no_scheduler_is_one_message(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(connection, "CONNECT_S", 1.0)
    scene = make_cove(tmp_path / "scene")
    with socket.create_server(("127.0.0.1", 0)) as mute:
        address = f"tcp://127.0.0.1:{mute.getsockname()[1]}"
        with pytest.raises(ClusterLost, match="no Dask scheduler answers within 1 s") as caught:
            bake(scene, tmp_path / "out", BuildOptions(cluster=address))
    with pytest.raises(ClusterLost, match="dask scheduler"):
        bake(scene, tmp_path / "out", BuildOptions(cluster=address))  # nobody listens there any more
    assert address in str(caught.value) and not (tmp_path / "out").exists()


def test_jobs_of_one_name_are_refused_before_a_cluster_is_asked() -> None:
    """Outcomes are counted by name: the call would wait for one more for ever."""
    with pytest.raises(ValueError, match="several jobs are named 'a'"):
        run_on_cluster("tcp://127.0.0.1:1", [Job("a", double, {"value": 1}), Job("a", double, {"value": 2})])


def test_a_worker_with_other_code_refuses_and_the_rest_goes_on(standing: Cluster) -> None:
    warnings: list[str] = []
    jobs = [
        Job("stale", double, {"value": 1}, code={"paradize.errors": "0" * 64}),
        Job("stale too", double, {"value": 1}, code={"paradize.errors": "0" * 64}),
        Job("own", double, {"value": 2}),
    ]
    stale, too, own = run_on_cluster(standing.address, jobs, warn=warnings.append)
    assert own.value == 4 and own.error is None
    for outcome in (stale, too):
        assert socket.gethostname() in str(outcome.error) and "paradize.errors" in str(outcome.error)
        assert "install the same paradize there" in str(outcome.error)
    assert len(warnings) == 2  # of each worker once


@pytest.mark.parametrize("what", ["engine", "python"])
def test_a_worker_of_another_version_gets_nothing(
    standing: Cluster, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    if what == "engine":
        monkeypatch.setattr(cluster, "PROTOCOL", "other")
    else:
        monkeypatch.setattr(cluster.platform, "python_version_tuple", lambda: ("3", "99", "0"))
    (outcome,) = run_on_cluster(standing.address, [Job("a", double, {"value": 1})])
    assert isinstance(outcome.error, BakeError) and f"runs {what} " in str(outcome.error)
    assert "install the same paradize there" in str(outcome.error)


def test_an_interrupted_bake_leaves_nothing_running_there(standing: Cluster, tmp_path: Path) -> None:
    """`stalled_job` returns when the other job runs; its process is waited for through its descriptor."""
    found: list[int] = []

    def interrupt(outcome: Outcome) -> None:
        found.append(os.pidfd_open(int(standing.stalled_job().split()[1])))
        raise KeyboardInterrupt

    jobs = [Job("stalled", stall_once, {}), Job("quick", double, {"value": 1})]
    with pytest.raises(KeyboardInterrupt):
        run_on_cluster(standing.address, jobs, interrupt)
    ended, _, _ = select.select(found, [], [], 60.0)
    os.close(found[0])
    assert ended


@pytest.mark.deep  # one that is interrupted: above
def test_a_bake_that_is_killed_leaves_nothing_running_there(standing: Cluster) -> None:
    code = (
        "import sys; from paradize.cluster.scheduler import run_on_cluster; "
        "from paradize.jobs.pool import Job; from tests.pipeline.clusters import stall; "
        "run_on_cluster(sys.argv[1], [Job('stalled', stall, {})])"
    )
    with started([sys.executable, "-c", code, standing.address], cwd=ROOT) as client:
        stalled = os.pidfd_open(int(standing.stalled_job().split()[1]))
        client.kill()
    ended, _, _ = select.select([stalled], [], [], 60.0)
    os.close(stalled)
    assert ended


def test_a_process_waits_for_work_for_a_while_only() -> None:
    outcome = dask_worker._run("a bake", Job("a", double, {"value": 1}), 1)
    assert outcome.value == 2 and not dask_worker._BUSY
    ((pool, timer),) = dask_worker._IDLE.items()
    (worker,) = pool.workers
    assert timer.is_alive() and timer.interval == dask_worker.IDLE_S and worker.process.poll() is None
    timer.cancel()
    timer.function(*timer.args)
    assert worker.process.poll() is not None and not dask_worker._IDLE


def paradize(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-m", "paradize.cli.main", *words],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=environment,
    )


@pytest.mark.deep
def test_the_command_prints_one_json_object_and_nothing_of_dask(standing: Cluster, tmp_path: Path) -> None:
    scene = make_cove(tmp_path / "scene")
    done = paradize("bake", str(scene), "--cluster", standing.address, "--json", cwd=tmp_path)
    report = json.loads(done.stdout)
    assert done.returncode == 0 and report["baked"] == 14
    assert "distributed" not in done.stderr and "Traceback" not in done.stderr
    again = paradize("bake", str(scene), "--cluster", standing.address, "--json", cwd=tmp_path)
    assert json.loads(again.stdout)["reused"] == 14


def test_an_address_that_is_none_is_wrong_usage(tmp_path: Path) -> None:
    done = paradize("bake", "a.toml", "--cluster", "render-farm", cwd=tmp_path)
    assert done.returncode == 2 and "write tcp://HOST:PORT" in done.stderr


def test_without_the_library_one_message_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(BakeError, match=r"pip install 'paradize\[cluster\]'"):
        run_on_cluster("tcp://127.0.0.1:1", [Job("a", double, {"value": 1})])


def test_files_that_go_with_a_worker_are_sent_anew(standing: Cluster, tmp_path: Path) -> None:
    """One job at a time: the worker that is killed has the only copy."""
    file = tmp_path / "file"
    file.write_bytes(os.urandom(1_000_000))
    jobs = [Job(f"job {i}", read_late, {"paths": [file]}, files={file: True}) for i in range(4)]
    with killing_who_stalls(standing) as killed:
        outcomes = run_on_cluster(standing.address, jobs, max_parallel=1)
    assert killed and [outcome.value for outcome in outcomes] == [[file.read_bytes()]] * 4


def test_a_scheduler_that_goes_leaves_the_old_scene_and_what_was_baked(
    standing: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, out = sky_and_sound(make_cove(tmp_path / "scene")), tmp_path / "out"
    assert not bake(scene, out, BuildOptions(jobs=1)).errors
    before = contents(out)
    module, _ = registry.BAKERS["sound"]
    monkeypatch.setitem(registry.BAKERS, "sound", (module, stall_once))

    def kill() -> None:
        standing.stalled_job()
        assert standing.scheduler
        standing.scheduler.kill()

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    report = bake(scene, out, BuildOptions(force=True, cluster=standing.address))
    thread.join()
    (said,) = {str(error) for error in report.errors}
    assert (
        said.startswith(f"{standing.address}: the connection to the scheduler was lost")
        and "start it again" in said
    )
    assert contents(out) == before
