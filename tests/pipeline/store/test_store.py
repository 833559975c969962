"""The store gives back what was put, notices damage, and files appear whole; workers fail alone."""

from __future__ import annotations

import errno
import os
import select
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import paradize
from paradize.errors import BakeError, SourceError
from paradize.jobs.code import code_digest, code_files
from paradize.jobs.libraries import library_versions
from paradize.jobs.pool import Job, run_jobs
from paradize.store.atomic import PARTIAL, remove_partial, write_whole
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Store, key_of, stamp
from tests.processes import started


def double(value: int) -> int:
    return 2 * value


def refuse(name: str) -> None:
    raise SourceError("is broken", file=name, place="line 3", mend="mend it")


def surprise() -> None:
    raise RuntimeError("never seen before")


def crash() -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def hang() -> None:
    time.sleep(600)


def tell_and_hang() -> None:
    os.write(2, f"{os.getpid()}\n".encode())
    hang()


def chatter() -> int:
    print("a library that prints")
    os.write(1, b"and one that writes\n")
    return 7


def test_blobs_come_back_and_damaged_ones_do_not(tmp_path: Path) -> None:
    store = Store(tmp_path)
    sha256 = store.put(b"sand" * 1000)
    assert store.get(sha256) == b"sand" * 1000
    blob = tmp_path / "blobs" / sha256[:2] / sha256
    blob.write_bytes(b"sand" * 999 + b"salt")
    assert store.get(sha256) is None and not blob.exists()
    assert store.put(b"sand" * 1000) == sha256 and store.get(sha256) is not None
    assert store.get("0" * 64) is None


def test_a_damaged_blob_is_neither_found_nor_kept_where_it_is_put_again(tmp_path: Path) -> None:
    store = Store(tmp_path)
    sha256 = store.put(b"whole")
    path = tmp_path / "blobs" / sha256[:2] / sha256
    for again in (lambda: store.put(b"whole"), lambda: store.take(tmp_path / "file")):
        path.write_bytes(b"other")
        assert store.find(sha256) is None and not path.exists()
        path.write_bytes(b"other")
        (tmp_path / "file").write_bytes(b"whole")
        assert again() == sha256 and path.read_bytes() == b"whole"


def test_a_damaged_record_is_no_record(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.put_product("ab" * 32, {"x": 1})
    assert store.get_product("ab" * 32) == {"x": 1}
    path = tmp_path / "products" / "ab" / ("ab" * 32)
    whole = path.read_bytes()
    for damaged in (b"", b'{"x": ', whole[:-1], whole.replace(b": 1", b": 2"), b"\xff" + whole[1:]):
        path.write_bytes(damaged)  # also where it is JSON still
        assert store.get_product("ab" * 32) is None


def test_keys_depend_on_everything_and_on_no_order_of_names() -> None:
    assert key_of("a", {"x": 1, "y": 2.0}) == key_of("a", {"y": 2.0, "x": 1})
    assert len({key_of("a", 1), key_of("a", 2), key_of("b", 1), key_of("a", "1"), key_of(["a", 1])}) == 5


def test_files_appear_whole_and_folders_are_made(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b" / "c.bin"
    write_whole(path, b"one")
    write_whole(path, b"two")
    assert path.read_bytes() == b"two" and [p.name for p in path.parent.iterdir()] == ["c.bin"]
    (path.parent / f".c.bin{PARTIAL}123").write_bytes(b"left by a kill")
    remove_partial(path.parent)
    assert [p.name for p in path.parent.iterdir()] == ["c.bin"]


def test_a_store_that_cannot_be_written_names_what_moves_it(tmp_path: Path) -> None:
    (tmp_path / "bakes").write_text("in the way")
    with pytest.raises(BakeError, match="move it away, or name another place with PARADIZE_STORE"):
        Store(tmp_path).put_bake("a", {})


def test_a_place_that_cannot_be_written_is_one_error_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(BakeError, match="cannot be written"):
        write_whole(tmp_path / "file" / "x", b"x")
    (tmp_path / "folder").mkdir()
    with pytest.raises(BakeError, match="is a folder; move it away"):
        write_whole(tmp_path / "folder", b"x")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


def test_a_pipe_is_never_replaced_by_a_file(tmp_path: Path) -> None:
    pipe, link = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for path in (pipe, link):
        with pytest.raises(BakeError, match="is not a regular file"):
            write_whole(path, b"x")
    assert pipe.is_fifo() and link.is_symlink()


def test_a_link_stays_and_the_file_that_it_leads_to_is_written(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    link = tmp_path / "link"
    link.symlink_to("real/file")
    for data in (b"made", b"replaced"):  # at first it leads to nothing
        write_whole(link, data)
        assert link.is_symlink() and (tmp_path / "real/file").read_bytes() == data
    write_whole(link, b"ours", owned=True)
    assert not link.is_symlink() and (tmp_path / "real/file").read_bytes() == b"replaced"
    assert [path.name for path in (tmp_path / "real").iterdir()] == ["file"]


def test_a_circular_link_is_refused_and_stays(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to("link")
    with pytest.raises(BakeError, match="cannot be written: Too many levels of symbolic links; name another"):
        write_whole(link, b"made")
    assert link.is_symlink() and [path.name for path in tmp_path.iterdir()] == ["link"]


def test_a_full_disk_leaves_the_old_file_and_no_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    path = tmp_path / "a"
    write_whole(path, b"old")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(BakeError, match="No space left"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_the_memory_hashes_only_what_differs(tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.write_bytes(b"old")
    os.utime(old, ns=(0, 0))
    tree = FileHashCache().as_json([old])
    tree["since_ns"] += 10_000_000_000  # as if it had been remembered after the file came to rest
    memory = FileHashCache.from_json(tree)
    assert memory.unchanged([str(old)]) and memory.hashed == 0
    os.utime(old, ns=(5, 5))
    assert memory.unchanged([str(old)]) and memory.hashed == 1
    old.write_bytes(b"odd")
    assert not memory.unchanged([str(old)])
    assert not memory.unchanged([str(new)])
    assert not FileHashCache.from_json({"files": 3}).unchanged([str(old)])


def test_a_file_is_known_again_by_size_times_and_place_not_by_one_of_them(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"one")
    status = path.stat()
    known = [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]
    assert stamp(path) == stamp(str(path)) == known and stamp(tmp_path / "gone") is None
    os.utime(path, ns=(7, 7))
    tree = FileHashCache().as_json([path])
    young = FileHashCache.from_json(
        tree
    )  # its times say that it is old; that it was changed just now, they also say
    assert young.unchanged([str(path)]) and young.hashed == 1
    tree["since_ns"] += 10_000_000_000
    memory = FileHashCache.from_json(tree)
    assert memory.unchanged([str(path)]) and memory.hashed == 0
    path.write_bytes(b"two")
    os.utime(path, ns=(7, 7))  # as some tools do that copy and unpack
    assert not memory.unchanged([str(path)]) and memory.hashed == 1


def test_a_file_no_older_than_its_memory_is_hashed_again(tmp_path: Path) -> None:
    """Written twice within a clock tick, with the same size: the stamp may not tell."""
    path = tmp_path / "x"
    path.write_bytes(b"one")
    memory = FileHashCache.from_json(FileHashCache().as_json([path]))
    assert memory.unchanged([str(path)]) and memory.hashed == 1


def modules_behind(module: str) -> set[str]:
    """The package's modules that one needs: their paths without a suffix."""
    tops = [Path(top) for top in paradize.__path__]
    paths = [path.relative_to(top) for path in code_files(module) for top in tops if path.is_relative_to(top)]
    return {str(path.with_name(path.name.split(".")[0])) for path in paths}


def test_the_code_digest_covers_native_kernels_and_what_is_imported_late() -> None:
    late = {"bakers/terrain/tiles", "stages/terrain", "kernels/terrain/_terrain", "formats/glb/encode"}
    build = modules_behind("paradize.build.bake")
    assert {"build/bake", "errors", "data", "readers/heightmap"} | late <= build
    assert not [name for name in build if name.startswith("cli/")]
    terrain = modules_behind("paradize.bakers.terrain.mesh")
    assert "bakers/mesh/bake" not in terrain and "build/bake" not in terrain
    assert code_digest("paradize.bakers.terrain.mesh") != code_digest("paradize.bakers.sound")
    assert any(name.startswith("numpy-") for name in library_versions())


def test_outcomes_come_in_the_order_of_the_jobs() -> None:
    jobs = [Job(f"job {k}", double, {"value": k}) for k in range(6)]
    for workers in (1, 2):
        assert [outcome.value for outcome in run_jobs(jobs, workers)] == [0, 2, 4, 6, 8, 10]


def test_a_crash_a_hang_and_an_error_spoil_only_their_own_job() -> None:
    jobs = [
        Job("good one", double, {"value": 1}),
        Job("crashing one", crash, {}),
        Job("hanging one", hang, {}, timeout_s=1.0),
        Job("refused one", refuse, {"name": "a.obj"}),
        Job("surprising one", surprise, {}),
        Job("good two", double, {"value": 2}),
    ]
    good, crashed, hung, refused, surprised, last = run_jobs(jobs, 2)
    assert (good.value, good.error, last.value) == (2, None, 4)
    assert "crashing one" in str(crashed.error) and "SIGSEGV" in str(crashed.error)
    assert "longer than 1 s" in str(hung.error) and hung.tries == 2 and hung.seconds < 10.0
    assert str(refused.error) == "a.obj: line 3: is broken; mend it" and isinstance(
        refused.error, SourceError
    )
    assert "never seen before" in str(surprised.error) and isinstance(surprised.error, BakeError)


def test_what_libraries_print_never_reaches_standard_output() -> None:
    script = (
        "from tests.pipeline.store.test_store import chatter\n"
        "from paradize.jobs.pool import Job, run_jobs\n"
        "print(run_jobs([Job('c', chatter, {})], 1)[0].value)"
    )
    root = Path(__file__).resolve().parents[3]
    environment = {**os.environ, "PYTHONPATH": str(root)}
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, cwd=root, env=environment, timeout=300
    )
    assert result.stdout == "7\n", result.stderr
    assert "prints" in result.stderr and "writes" in result.stderr


def test_workers_die_with_their_parent() -> None:
    script = (
        "from tests.pipeline.store.test_store import tell_and_hang\n"
        "from paradize.jobs.pool import Job, run_jobs\n"
        "run_jobs([Job('h', tell_and_hang, {})], 1)"
    )
    root = Path(__file__).resolve().parents[3]
    places = {**os.environ, "PYTHONPATH": str(root)}
    command = [sys.executable, "-c", script]
    with started(command, stderr=subprocess.PIPE, text=True, cwd=root, env=places) as parent:
        worker = os.pidfd_open(int(parent.stderr.readline()))
        parent.kill()
        ended, _, _ = select.select([worker], [], [], 60.0)
        os.close(worker)
        assert ended, "the worker outlived its parent"


def test_a_second_holder_waits_for_the_lock(tmp_path: Path) -> None:
    store, seen = Store(tmp_path), []

    def second() -> None:
        with store.locked("out"):
            seen.append("second")

    with store.locked("out"):
        thread = threading.Thread(target=second)
        thread.start()
        time.sleep(0.1)
        seen.append("first")
    thread.join(timeout=10)
    assert seen == ["first", "second"]


def test_a_full_place_and_one_that_may_not_be_written_have_mends_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number, mend in (
        (errno.ENOSPC, "free space there, or name another place with -o"),
        (errno.EFBIG, "allow larger files (`ulimit -f`), or name another place with -o"),
        (errno.EROFS, "name another place with -o"),
        (errno.EIO, "name another place with -o"),
        (errno.ENOTDIR, "a file stands where a folder is needed: move it away, or name another place"),
    ):

        def full(_: int, number: int = number) -> None:
            raise OSError(number, os.strerror(number))

        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(BakeError) as caught:
            write_whole(tmp_path / "a", b"x")
        assert (caught.value.mend or "").startswith(mend) and list(tmp_path.iterdir()) == []
