"""The progress that a terminal shows, and the lines that everything else gets."""

from __future__ import annotations

import io
import json
import os
import pty
import re
import subprocess
import sys
import termios
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from paradize.cli.progress import Progress, Work, clock
from paradize.cli.watch import BakeProgress, TextReport
from paradize.errors import merged
from paradize.jobs.progress import Step
from paradize.store.local import Store
from paradize.watch.loop import WatchEvent
from paradize.watch.rebake import Baked
from tests.pipeline.scenes import make_cove, tone, write_image
from tests.processes import started

SHOWN = re.compile(r"(?P<runs>[^|\r]*) \|[^|]*\| (?P<done>\d+)/(?P<of>\d+)(?P<left>, [\d:]+ left)?")


def on_a_terminal(*words: str, cwd: Path) -> tuple[int, str, str]:
    """Exit code, standard output, and what a terminal of 150 columns got as standard error."""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (40, 150))
    command = [sys.executable, "-m", "paradize.cli.main", *words]
    environment = {**os.environ, "PARADIZE_STORE": str(cwd / "store"), "PARADIZE_REPORT": ""}
    with started(command, cwd=cwd, stdout=subprocess.PIPE, stderr=theirs, env=environment) as process:
        os.close(theirs)
        got = b""
        try:
            while part := os.read(ours, 65536):
                got += part
        except OSError:  # the other end is closed
            pass
        finally:
            os.close(ours)
        assert process.stdout
        out = process.stdout.read().decode()
        process.wait()
    return process.returncode, out, got.decode()


def test_a_terminal_shows_what_runs_what_is_done_and_the_time_left(tmp_path: Path) -> None:
    scene = make_cove(tmp_path / "scene")
    scene.write_text(scene.read_text().replace("lods = 3", "lods = 2"))
    code, _, first = on_a_terminal("bake", str(scene), "-j", "2", cwd=tmp_path)
    shown = list(SHOWN.finditer(first))
    assert code == 0 and len(shown) >= 24
    runs = {name for one in shown for name in one["runs"].strip().split(", ")}
    assert {"post mesh", "post maps", "sky", "sound", "post gutters", "post lod normal error"} <= runs
    assert any("," in one["runs"] for one in shown)  # two at once
    assert [int(one["done"]) for one in shown] == sorted(int(one["done"]) for one in shown)
    assert shown[-1]["done"] == shown[-1]["of"]
    assert not any(one["left"] for one in shown if one["done"] == "0")  # nothing is known of them
    assert any(one["left"] for one in shown if int(one["done"]) > 2)


@pytest.mark.deep  # what is remembered and reckoned with: below
def test_a_terminal_shows_the_time_left_from_the_start_where_the_scene_was_baked_before(
    tmp_path: Path, cove_store: Callable[[Path], Path]
) -> None:
    scene = make_cove(tmp_path / "scene")
    cove_store(tmp_path / "store")
    (scene.parent / "sea.ogg").write_bytes(tone(110.5))
    assert on_a_terminal("bake", str(scene), cwd=tmp_path)[0] == 0
    (scene.parent / "sea.ogg").write_bytes(tone(220.0))
    _, _, second = on_a_terminal("bake", str(scene), cwd=tmp_path)
    began = [one for one in SHOWN.finditer(second) if one["done"] == "0" and one["runs"].strip()]
    assert began and all(one["left"] for one in began)  # it takes as long as the last time, so far


@pytest.mark.deep
def test_the_display_is_gone_when_the_bake_is_over(tmp_path: Path) -> None:
    scene = make_cove(tmp_path / "scene")
    _, out, shown = on_a_terminal("bake", str(scene), "--json", cwd=tmp_path)
    assert json.loads(out)["baked"] == 14
    assert SHOWN.search(shown)
    lines = shown.rstrip().rpartition("\n")[2].split("\r")
    assert not SHOWN.search(lines[-1])


@pytest.mark.deep
def test_elsewhere_there_is_no_bar(tmp_path: Path) -> None:
    scene = make_cove(tmp_path / "scene")
    done = subprocess.run(
        [sys.executable, "-m", "paradize.cli.main", "bake", str(scene)],
        capture_output=True, text=True, cwd=tmp_path, env={**os.environ, "PARADIZE_REPORT": ""},
    )  # fmt: skip
    assert done.returncode == 0
    assert "\r" not in done.stderr + done.stdout and not SHOWN.search(done.stderr)
    assert all(
        re.match(r"paradize: (warning: |\d+ of \d+ done, )", line) for line in done.stderr.splitlines()
    )


class Lines(io.StringIO):
    """A stream that is not a terminal; `several` is set once it got three lines."""

    def __init__(self) -> None:
        super().__init__()
        self.several = threading.Event()

    def write(self, text: str) -> int:
        written = super().write(text)
        if self.getvalue().count("\n") >= 3:
            self.several.set()
        return written


def test_elsewhere_a_line_comes_now_and_then_until_the_work_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = Lines()
    monkeypatch.setattr(sys, "stderr", lines)
    progress = Progress(line_s=0.001)
    progress.step("levels of detail", 1, 4)
    assert lines.several.wait(60.0)
    progress.close()
    printed = lines.getvalue()
    assert re.fullmatch(r"(paradize: 1 of 4 done, [\d:]+ left: levels of detail\n)+", printed)
    progress._tick()
    assert lines.getvalue() == printed


def test_a_line_of_work_between_two_steps_ends_with_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once all steps are done nothing runs, and the line names nothing."""
    lines = Lines()
    monkeypatch.setattr(sys, "stderr", lines)
    progress = Progress(line_s=0.001)
    progress.step("levels of detail", 4, 4)
    assert lines.several.wait(60.0)
    progress.close()
    assert re.fullmatch(r"(paradize: 4 of 4 done, [\d:]+ left\n)+", lines.getvalue())


@pytest.mark.deep
def test_work_that_counts_its_own_steps_is_shown_on_a_terminal(tmp_path: Path) -> None:
    source = tmp_path / "rock.png"
    write_image(source, np.random.default_rng(1).integers(0, 255, (16, 16, 3), np.uint8))
    for words in (
        ("maps", "rock.png", "-o", "out"),
        ("check", "out"),
        ("measure", "rock.png", "-o", "m", "--runs", "1"),
    ):
        code, _, shown = on_a_terminal(*words, cwd=tmp_path)
        assert code == 0 and SHOWN.search(shown), (words, shown)


@pytest.mark.deep
def test_a_terminal_shows_the_steps_of_a_single_file(tmp_path: Path) -> None:
    quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"
    (tmp_path / "quad.obj").write_text(quad)
    write_image(tmp_path / "dune.png", np.random.default_rng(1).integers(0, 65535, (9, 9, 1), np.uint16))
    size = ("--size", "4", "4", "--height", "1")
    for words, steps in (
        (("mesh", "quad.obj", "-o", "quad.glb"), ["reading", "level 1 of 3", "tangent frames", "writing"]),
        (("terrain", "dune.png", "-o", "dune.glb", *size), ["reading", "triangles", "measuring", "writing"]),
        (("maps", "dune.png", "-o", "out", "--only", "normal"), ["reading", "measuring normal"]),
    ):
        code, _, shown = on_a_terminal(*words, cwd=tmp_path)
        runs = [one["runs"].strip() for one in SHOWN.finditer(shown)]
        at = [runs.index(f"{words[1]}: {step}") for step in steps]
        assert code == 0 and at == sorted(at), (words, runs)


def test_the_time_left_is_the_work_left_over_the_work_done_each_second() -> None:
    work = Work({"long": 30.0, "short": 10.0})
    work.planned(["long", "short", "new"])
    assert work.left_s(0.0) is None
    work.began("short", 100.0)
    work.began("long", 100.0)
    assert work.left_s(100.0) == pytest.approx(60.0)  # the new one as the mean of the known: 20
    work.ended("short", 10.0)
    assert work.left_s(110.0) == pytest.approx((20.0 + 20.0) / 2.0)  # two seconds of work in each
    work.began("new", 110.0)
    work.ended("long", 40.0)
    work.ended("new", 2.0)
    assert (work.done, work.count, work.left_s(140.0)) == (3, 3, 0.0)


def test_a_job_that_takes_longer_than_known_leaves_no_time_that_is_known() -> None:
    """It said 0:00 until the job was done."""
    work = Work({"short": 0.1, "late": 0.2, "long": 30.0})
    work.planned(["short", "late", "long", "new"])
    for name in ("short", "late", "long", "new"):
        work.began(name, 0.0)
    for name in ("short", "late"):
        work.ended(name, 0.3)
    assert work.left_s(20.0) == pytest.approx(10.0)  # of the long one, beside one that is late
    assert work.left_s(29.5) is None
    work.ended("long", 29.9)
    assert work.left_s(100.0) is None
    work.ended("new", 101.0)
    assert work.left_s(101.0) == 0.0


def test_the_time_left_is_no_less_than_that_of_a_job_that_runs() -> None:
    work = Work(dict.fromkeys("abcd", 10.0) | {"long": 60.0})
    work.planned([*"abcd", "long"])
    for name in (*"abcd", "long"):
        work.began(name, 0.0)
    for name in "abcd":
        work.ended(name, 10.0)
    assert work.left_s(10.0) == pytest.approx(50.0)  # not a fifth of it, though five were done each second


def test_a_job_that_is_tried_once_more_counts_once() -> None:
    work = Work({})
    work.planned(["a", "b"])
    work.began("a", 0.0)
    work.began("a", 5.0)
    work.ended("a", 1.0)
    work.ended("b", 1.0)  # ended before it began: its cluster was lost
    assert (work.done, work.count, work.left_s(6.0)) == (2, 2, 0.0)


def test_seconds_are_remembered_for_the_next_bake_of_the_scene(tmp_path: Path) -> None:
    store = Store(tmp_path)
    first = Progress(store, "island")
    first.planned(["palm"])
    first.began("palm")
    first.ended("palm", 12.3456)
    first.close()
    assert Progress(store, "island").known == {"palm": 12.346}
    assert Progress(store, "other").known == {}


@pytest.mark.parametrize(
    ("seconds", "shown"), [(0.4, "0:00"), (59.6, "1:00"), (61, "1:01"), (7325, "2:02:05")]
)
def test_times_are_told_as_clocks_do(seconds: float, shown: str) -> None:
    assert clock(seconds) == shown


def test_warnings_that_differ_in_their_line_alone_are_one() -> None:
    texts = [
        "a.mtl: line 8: map_kd: no file",
        "a.mtl: no end",
        "a.mtl: line 21: map_kd: no file",
        "a.mtl: no end",
    ]
    assert merged(texts) == ["a.mtl: lines 8, 21: map_kd: no file", "a.mtl: no end"]
    assert merged(texts[:2]) == texts[:2]
    many = merged(f"b.obj: line {k}: two corners are one" for k in range(9))
    assert many == ["b.obj: lines 0, 1, 2, 3, 4 and 4 more: two corners are one"]


def test_the_display_of_a_watch_counts_the_jobs_of_its_bake() -> None:
    display = BakeProgress()
    display.step(Step("late", 1, 2))  # of a bake that has ended
    display.start()
    display.step(Step("sky", 3, 7))
    assert display.shown is not None
    work = display.shown.work
    assert (work.done, work.count, work.named("bake")) == (3, 7, "bake: sky")
    display.end()
    assert display.shown is None


def test_a_watch_prints_a_warning_once(capsys: pytest.CaptureFixture[str]) -> None:
    def event(*warnings: str) -> WatchEvent:
        rows = [{"name": "post", "status": "baked"}]
        message = {"warnings": list(warnings), "artifacts": rows, "baked": 1, "reused": 0, "seconds": 0.5}
        return WatchEvent(Baked(message, Path("out")), (Path("scene.toml"),), False)

    report = TextReport()
    report(event("no UVs", "thin"))
    report(event("no UVs", "holes"))
    report(event())
    out, err = capsys.readouterr()
    assert err.splitlines() == [f"paradize: warning: {text}" for text in ("no UVs", "thin", "holes")]
    line = "scene.toml: 1 baked (post), 0 reused in 0.50 s, in out"
    assert out.splitlines() == [line, f"{line}; 1 warning as before", line]
