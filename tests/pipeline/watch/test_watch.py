"""`paradize watch` bakes what a save touches, and nothing that a person or an editor saves ends it."""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.cli import main as cli
from paradize.errors import BakeError, SourceError
from paradize.jobs.progress import Step
from paradize.store.local import stamp
from paradize.watch import loop as watch_module
from paradize.watch.rebake import Baked, bake_again
from tests.pipeline.own_package import copy_package
from tests.pipeline.scenes import make_cove, write_image
from tests.pipeline.small_scenes import make_post, without_object
from tests.processes import kill, start
from tests.sweeps import sweep

PATIENCE_S = 200.0  # a test that waits longer has failed


class Watched:
    """A running `paradize watch --json` of the cove. Its lines come as they are printed. prefix: the command
    that runs it."""

    def __init__(
        self,
        folder: Path,
        store: Path,
        *options: str,
        package: Path | None = None,
        prefix: Sequence[str] = (),
    ) -> None:
        self.folder, self.out = folder, folder.parent / "out"
        paths = [*([str(package)] if package else []), os.environ.get("PYTHONPATH", "")]
        environment = {"PARADIZE_STORE": str(store), "PYTHONPATH": os.pathsep.join(paths)}
        command = [*prefix, sys.executable, "-m", "paradize.cli.main", "watch", folder / "cove.toml"]
        self.process = start(
            [*command, "-o", self.out, "--json", *options],
            env={**os.environ, **environment},
            cwd=folder.parent,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.said: list[str] = []
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.listener = threading.Thread(target=self._listen, daemon=True)
        self.reader.start()
        self.listener.start()

    def _read(self) -> None:
        assert self.process.stdout
        with self.process.stdout:
            for line in self.process.stdout:
                self.lines.put(line)

    def _listen(self) -> None:
        assert self.process.stderr
        with self.process.stderr:
            for line in self.process.stderr:
                self.said.append(line)

    def close(self) -> None:
        """Leaves no process behind."""
        kill(self.process)
        self.reader.join()
        self.listener.join()

    def next(self) -> dict[str, Any]:
        """The output of the next bake."""
        try:
            found: dict[str, Any] = json.loads(self.lines.get(timeout=PATIENCE_S))
        except queue.Empty:
            raise AssertionError(f"nothing was baked; said: {self.said}") from None
        return found

    def baked(self, *names: str) -> set[str]:
        """The artifacts that the next bake, which these saves caused, made anew."""
        result = self.next()
        assert "error" not in result, result
        assert {Path(path).name for path in result["changed"]} == set(names)
        return {row["name"] for row in result["artifacts"] if row["status"] == "baked"}

    def end(self, number: int = signal.SIGINT) -> int:
        """The exit code; returns when no process of the watch is left (all hold its standard error)."""
        self.process.send_signal(number)
        code = self.process.wait(PATIENCE_S)
        self.listener.join(PATIENCE_S)
        assert not self.listener.is_alive()
        return code


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> Path:
    """A store that knows the cove."""
    return cove_store(tmp_path_factory.mktemp("known") / "store")


Watch = Callable[..., Watched]


@pytest.fixture
def watch(tmp_path: Path, store: Path) -> Iterator[Watch]:
    """Starts a watch of the cove, with a store that knows it. None is left after the test."""
    with ExitStack() as stack:

        def begin(*options: str, store: Path = store, **more: Any) -> Watched:
            found = Watched(tmp_path / "cove", store, *options, **more)
            stack.callback(found.close)
            return found

        yield begin


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory, store: Path) -> Iterator[Watched]:
    """A watch of the cove that goes on from test to test: each leaves a sound scene."""
    found = Watched(make_cove(tmp_path_factory.mktemp("watched") / "cove").parent, store)
    try:
        assert found.next()["failed"] == 0
        yield found
        assert found.end() == 0, found.said
    finally:
        found.close()


def picture(path: Path, shade: int) -> None:
    write_image(path, np.random.default_rng(shade).integers(0, 255, (32, 32, 3), np.uint8))


def written(path: Path, make: Callable[[Path], None]) -> None:
    """Saved as some editors do: beside, then renamed."""
    aside = path.with_name(f"aside-{path.name}")
    make(aside)
    aside.replace(path)


def test_a_saved_picture_bakes_its_own_artifacts_again(watched: Watched) -> None:
    manifest = watched.out / "scene.json"
    was = manifest.read_bytes()
    picture(watched.folder / "wood.png", 1)  # cut to nothing, and written
    assert watched.baked("wood.png") == {"post_color", "post_normal", "post_height", "post_gloss"}
    assert manifest.read_bytes() != was
    written(watched.folder / "sand.png", lambda path: picture(path, 2))
    assert watched.baked("sand.png") >= {"sand_color", "effect_color"}
    (watched.folder / "notes.txt").write_text("nothing of the scene")
    text = (watched.folder / "cove.toml").read_text()
    (watched.folder / "cove.toml").write_text(text.replace("density_per_m = 0.01", "density_per_m = 0.02"))
    assert watched.baked("cove.toml") == set()
    assert json.loads(manifest.read_bytes())["fog"]["density_per_m"] == 0.02


def test_a_broken_save_is_told_once_and_mended_by_the_next(watched: Watched) -> None:
    manifest, wood = watched.out / "scene.json", watched.folder / "wood.png"
    was, whole = manifest.read_bytes(), wood.read_bytes()
    wood.write_bytes(whole[: len(whole) // 2])
    result = watched.next()
    assert len(result["error"]) == 1 and "wood.png" in result["error"][0] and manifest.read_bytes() == was
    picture(watched.folder / "sand.png", 3)  # still broken: the same error, which is not told again
    picture(wood, 4)
    mended = watched.next()
    assert "error" not in mended and manifest.read_bytes() != was
    assert str(wood) in mended["changed"]
    assert sum(result["error"][0] in line for line in watched.said) == 1


@pytest.mark.deep
def test_a_scene_may_be_broken_and_name_what_comes_later(watched: Watched) -> None:
    scene = watched.folder / "cove.toml"
    text = scene.read_text()
    scene.write_text(text[: len(text) // 2] + '"')
    assert "is not TOML" in watched.next()["error"][0]
    scene.write_text(text.replace('color = "wood.png"', 'color = "new/oak.png"'))
    assert "new/oak.png" in watched.next()["error"][0]
    (watched.folder / "later").mkdir()
    picture(watched.folder / "later/oak.png", 5)
    (watched.folder / "later").rename(watched.folder / "new")
    assert "post_color" in watched.baked("new")
    picture(watched.folder / "new/oak.png", 6)
    assert "post_color" in watched.baked("oak.png")
    scene.write_text(text)
    assert "error" not in watched.next()


@pytest.mark.parametrize("name", sweep(["wood.png", "cove.toml", "post.obj"], test=["wood.png"]))
def test_a_pipe_in_a_files_place_is_told_and_the_watch_goes_on(watched: Watched, name: str) -> None:
    path = watched.folder / name
    good = path.read_bytes()
    os.mkfifo(watched.folder / "pipe")
    (watched.folder / "pipe").replace(path)
    assert name in watched.next()["error"][0]
    (watched.folder / "good").write_bytes(good)
    (watched.folder / "good").replace(path)
    assert watched.baked(name) == set()


@pytest.mark.deep  # of what the scene names: above; of `bake`: tests/pipeline/cli/test_strange_files.py
def test_what_a_material_names_and_is_no_file_is_told_once(tmp_path: Path, watch: Watch) -> None:
    scene = make_cove(tmp_path / "cove")
    scene.write_text(scene.read_text().replace('color = "wood.png"\n', ""))
    watched = watch()
    assert watched.next()["failed"] == 0
    was = (watched.out / "scene.json").read_bytes()
    wood = watched.folder / "wood.png"
    wood.unlink()
    os.mkfifo(wood)
    result = watched.next()
    if "error" not in result:  # it was missing for a moment
        was = (watched.out / "scene.json").read_bytes()
        result = watched.next()
    assert "wood.png: cannot be read: is " in result.get("error", [""])[0]
    picture(watched.folder / "sand.png", 3)  # the same error, which is not told again
    (watched.folder / "post.mtl").write_text("newmtl wood\nmap_Kd sand.png\n")
    assert (watched.out / "scene.json").read_bytes() == was
    result = watched.next()
    assert "error" not in result and str(watched.folder / "post.mtl") in result["changed"]
    assert watched.end() == 0 and watched.lines.empty()


def test_a_bake_shows_its_start_its_jobs_and_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = without_object(make_cove(tmp_path / "cove"))
    seen: list[str | Step] = []

    def interrupt(event: watch_module.WatchEvent) -> None:
        assert not event.baked.errors
        raise KeyboardInterrupt

    watched = watch_module.Watch(
        scene,
        tmp_path / "out",
        1,
        None,
        interrupt,
        on_start=lambda: seen.append("start"),
        on_step=seen.append,
        on_end=lambda: seen.append("end"),
    )
    try:
        with pytest.raises(KeyboardInterrupt):
            watched.run()
    finally:
        watched.stop()
    start, *steps, end = seen
    assert (start, end) == ("start", "end") and len(steps) > 5
    counted = [step for step in steps if isinstance(step, Step)]
    assert [step.done for step in counted] == list(range(len(steps))) and counted[-1].total == len(steps)


def test_errors_are_told_again_only_after_a_bake_without_them(tmp_path: Path) -> None:
    told: list[Baked] = []
    watched = watch_module.Watch(tmp_path / "a.toml", None, 1, None, lambda event: told.append(event.baked))
    broken, sound = Baked(errors=[BakeError("is no picture", file="wood.png")]), Baked()
    for baked in (broken, broken, sound, broken):
        watched._report(baked)
    assert told == [broken, sound, broken]


def test_nothing_is_baked_again_for_a_stamp_that_a_bake_left_as_it_was(tmp_path: Path) -> None:
    """A bake whose record never agrees with a file, whatever the reason, ends after one more."""
    odd = tmp_path / "odd"
    odd.touch()
    watched = watch_module.Watch(tmp_path / "a.toml", None, 1, None, lambda event: None)
    try:
        for due in (True, False, False):
            watched._due = False
            watched._look_at({odd: None})
            assert watched._due is due
        odd.write_text("changed")
        watched._look_at({odd: None})
        assert watched._due
    finally:
        watched.stop()


@pytest.mark.parametrize("at_once", [False, True])
def test_a_folder_that_was_renamed_or_replaced_is_watched_again(tmp_path: Path, at_once: bool) -> None:
    """As a checkout does it, and an export that writes beside its place and renames."""
    model, aside = tmp_path / "model", tmp_path / "aside"
    picture = model / "wood.png"
    for folder in (model, tmp_path / "new"):
        folder.mkdir()
        (folder / "wood.png").touch()
    watched = watch_module.Watch(tmp_path / "a.toml", None, 1, None, lambda event: None)

    def look_after_the_save_of(*paths: Path) -> None:
        missing = set(paths)
        while missing:
            saved = watched._queue.get(timeout=20.0)
            watched._saved(saved)
            missing -= saved
        watched._look_at({picture: stamp(picture)}, keep=True)

    try:
        watched._look_at({picture: stamp(picture)})
        model.rename(aside)
        if not at_once:
            look_after_the_save_of(model)
        (tmp_path / "new" if at_once else aside).rename(model)
        look_after_the_save_of(model)
        picture.write_text("saved")
        look_after_the_save_of(picture)
    finally:
        watched.stop()


def test_a_file_that_was_looked_for_in_vain_is_among_those_that_are_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the scene uses it for nothing more than that."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = make_post(tmp_path / "cove")
    text = scene.read_text().replace("lods = 3", "lods = 1").replace('color = "wood.png"\n', "")
    scene.write_text(text.replace("parallax_scale = 0.01\n", ""))
    library = tmp_path / "cove/post.mtl"
    library.unlink()
    baked = bake_again(scene, tmp_path / "out", 1, None, None, None, False)
    assert not baked.errors and baked.reads[library] is None


def test_after_a_failed_bake_material_files_are_among_those_that_are_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A change of one may name another picture than that which fails."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = make_post(tmp_path / "cove")
    scene.write_text(scene.read_text().replace('color = "wood.png"\n', ""))
    picture = tmp_path / "cove/wood.png"
    picture.write_bytes(b"no picture")
    baked = bake_again(scene, tmp_path / "out", 1, None, None, None, False)
    assert {error.file for error in baked.errors} == {str(picture)}
    assert baked.reads.keys() >= {scene, picture, tmp_path / "cove/post.mtl", tmp_path / "cove/post.obj"}


def test_a_file_saved_while_a_bake_fails_is_baked_once_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = make_cove(tmp_path)
    picture = tmp_path / "wood.png"
    clock = picture.stat().st_ctime_ns
    for saved_ns, is_late in ((-1, False), (1, True)):
        monkeypatch.setattr("paradize.watch.rebake.time.time_ns", lambda at=clock - saved_ns: at)

        def fail(*_: Any) -> None:
            raise SourceError("changed while it was baked", file=picture, mend="bake again")

        monkeypatch.setattr("paradize.build.bake.bake", fail)
        monkeypatch.setattr("signal.signal", lambda *_: None)
        baked = bake_again(scene, None, 1, None, None, None, forget_record=False)
        assert (baked.reads[picture] is None) == is_late and baked.foreign is None


@pytest.mark.deep
def test_a_file_that_was_looked_for_in_vain_is_waited_for(tmp_path: Path, watch: Watch) -> None:
    scene = make_cove(tmp_path / "cove")
    scene.write_text(scene.read_text().replace('color = "wood.png"\n', ""))
    library = tmp_path / "cove/post.mtl"
    text = library.read_text()
    library.unlink()
    watched = watch()
    assert "post_color" not in {row["name"] for row in watched.next()["artifacts"]}
    library.write_text(text)
    result = watched.next()
    assert result["changed"] == [str(library)]
    assert "post_color" in {row["name"] for row in result["artifacts"]}
    assert watched.end(signal.SIGTERM) == 0


@pytest.mark.deep
def test_changed_code_is_run_and_broken_code_does_not_end_the_watch(tmp_path: Path, watch: Watch) -> None:
    """On a copy of the package."""
    package = copy_package(tmp_path / "path")
    make_cove(tmp_path / "cove")
    watched = watch(package=package.parent)
    assert watched.next()["restarted"] is False
    baker = package / "bakers/sound.py"
    text = baker.read_text()
    baker.write_text(text + "\n# changed\n")
    result = watched.next()
    assert result["restarted"] is True and result["changed"] == []
    assert [row["name"] for row in result["artifacts"] if row["status"] == "baked"] == ["sound"]
    baker.write_text(text + "\ndef (\n")
    assert "SyntaxError" in watched.next()["error"][0]
    baker.write_text(text)
    result = watched.next()
    assert "error" not in result and result["baked"] == 0
    assert watched.end() == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.deep  # of `bake`: tests/pipeline/cli/test_cli.py; of a watch that waits: all that use `watched`
def test_an_interrupt_in_a_bake_ends_it_and_leaves_nothing_half_done(
    tmp_path: Path, watch: Watch, number: int
) -> None:
    make_cove(tmp_path / "cove")
    watched = watch(store=tmp_path / "store")
    scratch = tmp_path / "store/scratch"
    while not list(scratch.glob("*")):  # the bake has begun
        with pytest.raises(subprocess.TimeoutExpired):  # the watch still runs
            watched.process.wait(0.01)
    assert watched.end(number) == 0
    assert not list(scratch.glob("*")) and watched.lines.empty()
    assert not (watched.out / "scene.json").exists()
    assert not [line for line in watched.said if "Traceback" in line or "error" in line]


def test_a_watch_bakes_what_bake_does_by_itself() -> None:
    watch, once = (cli.parser(name).parse_args([name, "cove.toml"]) for name in ("watch", "bake"))
    assert (watch.out, watch.jobs, watch.tier) == (once.out, once.jobs, once.tier)


def test_where_interrupts_are_ignored_it_says_how_to_end_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(watch_module.Watch, "run", lambda _: None)
    words = [str(make_cove(tmp_path / "cove")), "-o", str(tmp_path / "out")]
    for ignored, ends in ((True, f"`kill {os.getpid()}`"), (False, "Ctrl-C")):
        was = signal.signal(signal.SIGINT, signal.SIG_IGN if ignored else signal.default_int_handler)
        try:
            assert cli.main(["watch", *words]) == 0
        finally:
            signal.signal(signal.SIGINT, was)
        assert f"{ends} ends it" in capsys.readouterr().err


@pytest.mark.deep
def test_where_interrupts_are_ignored_it_names_the_signal_that_ends_it(tmp_path: Path, watch: Watch) -> None:
    """As `nohup paradize watch &` in a script has it."""
    make_cove(tmp_path / "cove")
    watched = watch(prefix=["bash", "-c", 'trap "" INT; exec "$@"', "bash"])
    assert watched.next()["failed"] == 0
    watched.process.send_signal(signal.SIGINT)
    picture(tmp_path / "cove/wood.png", 12)
    assert "post_color" in watched.baked("wood.png")
    assert watched.end(signal.SIGTERM) == 0
    assert f"`kill {watched.process.pid}` ends" in watched.said[0]


def test_a_scene_that_is_not_there_is_refused(tmp_path: Path, watch: Watch) -> None:
    (tmp_path / "cove").mkdir()
    watched = watch()
    assert watched.process.wait(PATIENCE_S) == 1
    watched.listener.join(PATIENCE_S)
    assert "there is no such file" in watched.said[-1]


@pytest.mark.deep
def test_what_a_watch_bakes_is_shared(tmp_path: Path, watch: Watch) -> None:
    make_cove(tmp_path / "cove")
    shared = tmp_path / "shared"
    watched = watch("--store", str(shared))
    assert watched.next()["failed"] == 0
    picture(tmp_path / "cove/wood.png", 11)
    result = watched.next()
    assert result["baked"] and result["pushed"] >= result["baked"]
    whole = [row for row in result["artifacts"] if not (row["left_out"] or row["coarser_left_out"])]
    assert len(whole) > 10  # stores hold all levels, also of what was published without some
    for row in whole:
        assert (shared / "blobs" / row["sha256"][:2] / row["sha256"]).stat().st_size == row["bytes"]
