"""Full disks, refused folders, sources that change or vanish, clocks that go back, decay in the store, two
bakes at once: each ends in the old state or the new one, and the next bake mends it."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from paradize.artifact import Artifact
from paradize.bakers import registry
from paradize.bakers.registry import Product
from paradize.build import publish
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.store import file_hashes as memory
from paradize.store.atomic import PARTIAL, write_whole
from paradize.store.local import hash_file
from tests.pipeline.scenes import make_cove
from tests.processes import started
from tests.sweeps import sweep

ROOT = Path(__file__).resolve().parents[3]


def state_of(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(out.iterdir())}


def names_baked(report: BakeReport) -> set[str]:
    return {row["name"] for row in report.rows if row["status"] == "baked"}


class Cove:
    """A scene of two looks, sand and wood, what each bakes to, and a store that knows both."""

    def __init__(self, top: Path) -> None:
        self.top, self.scene, self.out, self.store = top, top / "scene/cove.toml", top / "out", top / "store"
        self.looks = [(top / "scene" / name).read_bytes() for name in ("sand.png", "wood.png")]
        self.states: list[dict[str, bytes]] = []

    def show(self, look: int) -> None:
        (self.scene.parent / "sand.png").write_bytes(self.looks[look])

    def bake(self, **how: Any) -> BakeReport:
        return bake(self.scene, self.out, BuildOptions(**how))

    def command(self, *words: str) -> list[str]:
        words = (str(self.scene), "-o", str(self.out), *words)
        return [sys.executable, "-m", "paradize.cli.main", "bake", *words]


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> Cove:
    """Baked in both looks; the first is published."""
    cove = Cove(make_cove(tmp_path_factory.mktemp("cove") / "scene").parent.parent)
    cove.scene.write_text(cove.scene.read_text().replace("lods = 3", "lods = 1"))  # more are measured long
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(cove_store(cove.store)))
        for look in (1, 0):
            cove.show(look)
            assert not cove.bake().errors
            cove.states.insert(0, state_of(cove.out))
    assert cove.states[0] != cove.states[1]
    return cove


def copy_of(original: Cove, top: Path) -> Cove:
    for name in ("scene", "out", "store"):
        shutil.copytree(original.top / name, top / name)
    cove = Cove(top)
    cove.looks, cove.states = original.looks, original.states
    return cove


@pytest.fixture
def cove(original: Cove, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Cove:
    """A copy of the original of the test's own, the store warm."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("PARADIZE_REPORT", "")
    return copy_of(original, tmp_path)


# A full disk. The disk is a mount that only a child sees, so that what is done on it is done there.


def bake_on_full_disks(folder: str, rooms: tuple[int, ...]) -> None:
    """In the child: the scene, its looks and their states are in `folder`, the disk is its folder `disk`.
    rooms: blocks of 4096 bytes that are left, one bake each; a thousand are enough for a bake."""
    top = Path(folder)
    disk = top / "disk"
    cove = Cove(top)
    cove.out, cove.store = disk / "out", disk / "store"
    os.environ["PARADIZE_STORE"] = str(cove.store)
    cove.states = [state_of(top / f"state{look}") for look in range(2)]
    cove.show(1)
    full = 0
    for room in rooms:
        shutil.rmtree(cove.out, ignore_errors=True)
        shutil.rmtree(cove.store, ignore_errors=True)  # everything is to be written
        shutil.copytree(top / "state0", cove.out)
        with (disk / "filler").open("wb") as filler:
            filler.write(bytes(max(0, shutil.disk_usage(disk).free - 4096 * room)))
        done = subprocess.run(cove.command("--json", "-j", "2"), capture_output=True, text=True, check=False)
        report, after = json.loads(done.stdout), state_of(cove.out)
        if done.returncode:
            full += 1
            assert report["error"] and all("No space left" in text for text in report["error"]), report
            assert "Traceback" not in done.stderr and "internal error" not in done.stderr, done.stderr
        whole = [state for state in cove.states if state["scene.json"] == after["scene.json"]]
        assert len(whole) == 1 and whole[0].items() <= after.items()
        assert done.returncode or whole[0] is cove.states[1]
        assert not [name for name in after if PARTIAL in name]
        (disk / "filler").unlink()
        assert not cove.bake().errors and state_of(cove.out) == cove.states[1], f"{room} blocks"
    assert full == sum(room < 1000 for room in rooms), f"{full} times full"


@pytest.mark.deep
@pytest.mark.parametrize("rooms", [(40,), (0, 8, 40, 4096)])
def test_a_full_disk_leaves_the_old_state_or_the_new(
    original: Cove, tmp_path: Path, rooms: tuple[int, ...]
) -> None:
    """With both the store and the artifacts on it, full at the first byte or later."""
    own = ["unshare", "-rm"]
    mount = f"mount -t tmpfs -o size=64m none {tmp_path}/disk"
    (tmp_path / "disk").mkdir()
    if subprocess.run([*own, "sh", "-c", mount], capture_output=True, check=False).returncode:
        pytest.skip("a file system of one's own cannot be mounted here")
    shutil.copytree(original.top / "scene", tmp_path / "scene")
    for look, state in enumerate(original.states):
        (tmp_path / f"state{look}").mkdir()
        for name, data in state.items():
            (tmp_path / f"state{look}" / name).write_bytes(data)
    script = (
        f"from tests.pipeline.store.test_safe import bake_on_full_disks as b; b({str(tmp_path)!r}, {rooms})"
    )
    command = [*own, "sh", "-c", f'{mount} && exec "$@"', "sh", sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr


# Places that may not be read or written. Root may do everything: then a child does it without that right.

_RIGHTS = "-dac_override,-dac_read_search"
OBEDIENT = [] if os.geteuid() else ["setpriv", f"--bounding-set={_RIGHTS}", f"--inh-caps={_RIGHTS}"]


def run_obedient(words: list[str]) -> tuple[int, list[str]]:
    """The exit code and the errors of a command of paradize with --json."""
    done = subprocess.run([*OBEDIENT, *words, "--json"], capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr and "internal error" not in done.stderr, done.stderr
    return done.returncode, json.loads(done.stdout).get("error", [])


@pytest.mark.parametrize(
    ("refused", "mode", "text"),
    [
        ("out", 0o500, "cannot be written: Permission denied"),
        pytest.param("store/blobs", 0o500, "cannot be written: Permission denied", marks=pytest.mark.deep),
        pytest.param("store/products", 0o500, "cannot be written: Permission denied", marks=pytest.mark.deep),
        pytest.param("store", 0o500, "store cannot be written: Permission denied", marks=pytest.mark.deep),
        ("scene/wood.png", 0o000, "ermission denied"),
        pytest.param("scene/post.obj", 0o000, "ermission denied", marks=pytest.mark.deep),
        pytest.param("scene/cove.toml", 0o000, "ermission denied", marks=pytest.mark.deep),
    ],
)
def test_what_is_refused_is_told_clearly_and_leaves_the_old_state(
    cove: Cove, refused: str, mode: int, text: str
) -> None:
    path = cove.top / refused
    if refused.startswith("store"):  # all is to be written
        shutil.rmtree(path)
        path.mkdir()
    cove.show(1)
    usual = path.stat().st_mode
    path.chmod(mode)
    try:
        code, errors = run_obedient(cove.command("-j", "1"))
    finally:
        path.chmod(usual)
    assert code == 1 and errors and any(text in error for error in errors), errors
    assert state_of(cove.out) == cove.states[0]
    assert not cove.bake().errors and state_of(cove.out) == cove.states[1]


def test_a_store_that_refuses_to_be_cleaned_is_one_error(cove: Cove) -> None:
    folder = next((cove.store / "products").iterdir())
    folder.chmod(0o500)
    clean = [sys.executable, "-m", "paradize.cli.main", "clean", "--to-size", "0"]
    try:
        code, (error,) = run_obedient(clean)
    finally:
        folder.chmod(0o700)
    assert code == 1 and "cannot be cleaned: Permission denied" in error
    assert run_obedient(clean) == (0, [])


# Sources that change while they are read. The worker meets the test at two pipes in the middle of it.


def read_in_halves(sources: dict[str, Path], settings: dict[str, Any], tier: str) -> list[Product]:
    """In the worker: publishes the sound, half of it read before and half after the meeting."""
    (path,) = sources.values()
    folder = path.parent
    with path.open("rb") as stream:
        data = stream.read(path.stat().st_size // 2)
        (folder / "half_read").write_bytes(b"now")  # waits for who reads that
        (folder / "go_on").read_bytes()
        data += stream.read()
    return [Product(Artifact("sound", suffix="ogg", tier="exact"), data)]


@pytest.mark.parametrize(
    "change",
    sweep(
        ["replaced", "overwritten", "cut", "removed", "replaced and put back"],
        test=["cut", "replaced and put back"],
    ),
)
def test_a_source_that_changes_in_mid_read_is_refused_and_the_next_bake_is_right(
    cove: Cove, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    sound = cove.scene.parent / "sea.ogg"
    for name in ("half_read", "go_on"):
        os.mkfifo(sound.with_name(name))
    whole = sound.read_bytes()
    other = whole[:-1] + bytes([whole[-1] ^ 1])

    def meddle() -> None:
        sound.with_name("half_read").read_bytes()
        if change == "overwritten":
            sound.write_bytes(other)
        elif change == "cut":
            sound.write_bytes(whole[: len(whole) // 3])
        elif change == "removed":
            sound.unlink()
        else:
            write_whole(sound, other)
            if change.endswith("back"):
                write_whole(sound, whole)
        sound.with_name("go_on").write_bytes(b"now")

    with monkeypatch.context() as patch:
        patch.setitem(registry.BAKERS, "sound", ("paradize.bakers.sound", read_in_halves))
        meddler = threading.Thread(target=meddle)
        meddler.start()
        report = cove.bake()
        meddler.join()
    (error,) = report.errors
    assert "changed while it was baked" in str(error) and "sea.ogg" in str(error)
    assert state_of(cove.out) == cove.states[0]
    sound.write_bytes(whole)
    assert not cove.bake().errors and state_of(cove.out) == cove.states[0]


# Clocks.


def test_a_clock_that_goes_back_hides_no_change(cove: Cove, monkeypatch: pytest.MonkeyPatch) -> None:
    """All files are from an hour ahead of it: what is no older than the record is read again. The edit keeps
    the size and puts the time back."""
    assert not cove.bake().errors
    past_ns = time.time_ns() - 3_600_000_000_000
    monkeypatch.setattr(memory.time, "time_ns", lambda: past_ns)
    os.utime(cove.scene)
    for _ in range(2):  # the second record is of the late clock
        assert cove.bake().count("reused") == 14
    was = cove.scene.stat()
    cove.scene.write_text(cove.scene.read_text().replace("max_error_m = 0.05", "max_error_m = 0.25"))
    os.utime(cove.scene, ns=(was.st_atime_ns, was.st_mtime_ns))
    assert cove.scene.stat().st_size == was.st_size
    assert names_baked(cove.bake()) == {"terrain_mesh"}


def test_files_from_the_future_are_read_again_and_bake_right(cove: Cove) -> None:
    future_s = time.time() + 86_400.0
    for path in [*cove.scene.parent.iterdir(), *(cove.store / "bakes").iterdir(), *cove.out.iterdir()]:
        os.utime(path, (future_s, future_s))
    assert cove.bake().count("reused") == 14
    cove.show(1)
    os.utime(cove.scene.parent / "sand.png", (future_s, future_s))
    assert not cove.bake().errors and state_of(cove.out) == cove.states[1]


# Decay in the store.


DECAY = list(itertools.product(["blobs", "products", "bakes"], ["flipped", "cut", "empty"]))


@pytest.mark.parametrize(("kind", "harm"), sweep(DECAY, test=DECAY[::4]))
def test_a_decayed_store_entry_is_derived_again(cove: Cove, kind: str, harm: str) -> None:
    """Each of its kind, in all of them at once, then the store is whole again."""
    cove.bake()
    entries = [path for path in (cove.store / kind).rglob("*") if path.is_file()]
    for path in entries:
        data = path.read_bytes()
        middle = len(data) // 2
        flipped = data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :] if data else b"x"
        path.write_bytes({"flipped": flipped, "cut": data[:middle], "empty": b""}[harm])
    shutil.rmtree(cove.out)
    report = cove.bake()
    assert not report.errors and state_of(cove.out) == cove.states[0]
    assert (report.count("baked") == 14) == (kind != "bakes")
    named = {row["sha256"] for row in report.rows}
    assert all(hash_file(cove.store / "blobs" / sha256[:2] / sha256) == sha256 for sha256 in named)
    shutil.rmtree(cove.out)
    assert cove.bake().count("reused") == 14 and state_of(cove.out) == cove.states[0]


# Two at once.


def test_what_decays_in_the_store_while_it_is_used_is_never_published(
    cove: Cove, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between the look at the store and the copy, all that it holds gets another first byte."""
    cove.show(1)
    true_manifest = publish.build_manifest

    def decay(*arguments: Any, **more: Any) -> dict[str, Any]:
        for blob in (cove.store / "blobs").glob("*/*"):
            data = blob.read_bytes()
            blob.write_bytes(bytes([data[0] ^ 1]) + data[1:] if data else b"x")
        return true_manifest(*arguments, **more)

    with monkeypatch.context() as patch:
        patch.setattr(publish, "build_manifest", decay)
        (error,) = cove.bake().errors
    assert "was changed while it was copied; bake again" in str(error)
    assert cove.states[0].items() <= state_of(cove.out).items()
    assert not cove.bake().errors and state_of(cove.out) == cove.states[1]


@pytest.mark.deep
@pytest.mark.parametrize("times", [2, 10])
def test_two_bakes_at_once_many_times_leave_one_of_the_two_whole(cove: Cove, times: int) -> None:
    """On one folder: of one scene, of two scenes, and baked anew; both succeed."""
    other = cove.scene.with_name("other.toml")
    shutil.copy(cove.scene.parent / "wood.png", cove.scene.with_name("planks.png"))
    other.write_text(cove.scene.read_text().replace("sand.png", "planks.png"))
    assert not bake(other, cove.top / "other", BuildOptions()).errors
    states = [cove.states[0], state_of(cove.top / "other")]
    for i in range(times):
        scenes = [str(cove.scene), str(cove.scene if i % 2 else other)]
        words = ["-o", str(cove.out), "-j", "1", *(["--force"] if i % 5 == 0 else [])]
        command = [sys.executable, "-m", "paradize.cli.main", "bake"]
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        with (
            started([*command, scenes[0], *words], **pipes) as a,
            started([*command, scenes[1], *words], **pipes) as b,
        ):
            both = (a, b)
            result = [process.communicate(timeout=300)[1] for process in both]
        assert [process.returncode for process in both] == [0, 0], result
        assert state_of(cove.out) in (states if i % 2 == 0 else states[:1]), f"round {i}"
    assert not cove.bake().errors and state_of(cove.out) == states[0]


# Publishing.


def test_everything_is_flushed_before_it_is_named_and_the_scene_comes_last(
    cove: Cove, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each artifact: written aside, flushed, renamed; then their folder flushed; then scene.json, and the
    folder again."""
    events: list[tuple[str, str]] = []
    fsync, replace = os.fsync, os.replace

    def noted_fsync(descriptor: int) -> None:
        path = Path(os.readlink(f"/proc/self/fd/{descriptor}"))  # noqa: PTH115 (no path of ours)
        events.append(("flushed", "folder" if path.is_dir() else path.name))
        fsync(descriptor)

    def noted_replace(old: str, new: str, **more: Any) -> None:
        if Path(new).parent == out:
            events.append(("named", Path(new).name))
            assert ("flushed", Path(old).name) == events[-2]
        replace(old, new, **more)

    out = cove.top / "anew"
    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(os, "replace", noted_replace)
    assert not bake(cove.scene, out, BuildOptions()).errors
    parts = [events[i : i + 2] for i in range(0, 28, 2)]
    assert all([what for what, _ in part] == ["flushed", "named"] for part in parts)
    assert {name for _, (_, name) in parts} == state_of(out).keys() - {"scene.json"}
    assert events[28] == ("flushed", "folder") and events[29][0] == "flushed"
    assert events[30:] == [("named", "scene.json"), ("flushed", "folder")]
