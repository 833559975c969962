"""A running player shows a new bake without a restart."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import watchfiles

from paradize.build.bake import bake
from tests.conftest import RENDER_ENVIRONMENT, ROOT
from tests.pipeline.kept_workers import keeping_workers
from tests.pipeline.scenes import write_image
from tests.player.app.test_player import pixels
from tests.player.panel import make_panel
from tests.player.synthetic import checker, identity, texture, write_scene
from tests.processes import end, start
from tests.sweeps import sweep

Player = Callable[..., "subprocess.CompletedProcess[str]"]
FRAME_S = 1.0 / 30.0


class Running:
    """A player that draws frames into numbered pictures until it is ended, as many as one thread can."""

    def __init__(self, scene: Path, frames: Path) -> None:
        self.frames = frames
        words = ["--headless", "--frames", "1000000", "--size", "96x54", "--screenshot", frames / "f.png"]
        self.process = start(
            [ROOT / "build/bin/paradize-player", scene, *words],
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | RENDER_ENVIRONMENT | {"LP_NUM_THREADS": "0"},
        )

    def next_message(self) -> str:
        """The next line on standard error that does not say how far the run is."""
        assert self.process.stderr
        return next((line for line in self.process.stderr if " frames drawn, " not in line), "")

    def swapped(self) -> tuple[str, int]:
        """The number of new artifacts as text, and the first frame that shows them."""
        text = self.next_message()
        assert "scene.json was replaced" in text, text
        second = float(text.split("second ")[1].split()[0])
        return text.split("replaced: ")[1].split(" artifacts")[0], round(second / FRAME_S)

    def picture(self, number: int) -> Any:
        """The picture of a frame. It is complete when the next one exists."""
        after = self.frames / f"f_{number + 1:04d}.png"
        changes: Iterator[Any] = iter(watchfiles.watch(self.frames, step=10, rust_timeout=300_000))
        while not after.exists():
            next(changes)
        return pixels(self.frames / f"f_{number:04d}.png")


@contextmanager
def running(scene: Path, frames: Path) -> Iterator[Running]:
    frames.mkdir()
    player = Running(scene, frames)
    try:
        yield player
    finally:
        end(player.process)


def publish(scene: Path, tree: Any) -> None:
    """Replaces scene.json by renaming a file, as a bake does."""
    aside = scene / ".scene.json.part"
    aside.write_text(json.dumps(tree))
    aside.replace(scene / "scene.json")


def recolored(scene: Path, name: str, color: tuple[int, int, int]) -> Any:
    """Writes a new colour map for the box. Returns the changed scene.json."""
    tree = json.loads((scene / "scene.json").read_text())
    artifact = tree["artifacts"]["box_color"]
    data = texture("RGBA8_SRGB", checker(color, color))
    (scene / name).write_bytes(data)
    artifact |= {"file": name, **identity(data)}
    return tree


def test_frames_after_a_swap_equal_those_of_a_player_started_with_the_new_scene(
    player: Player, tmp_path: Path
) -> None:
    scene = write_scene(tmp_path / "scene")
    with running(scene, tmp_path / "frames") as run:
        run.picture(0)
        publish(scene, recolored(scene, "green.ktx2", (10, 250, 10)))
        (scene / "box_color.ktx2").unlink()
        what, frame = run.swapped()
        assert what.startswith("1 of ")
        seen = run.picture(frame).astype(int)
        before = run.picture(frame - 1).astype(int)
        assert ((seen - before)[..., 1] > 40).any(), "the box did not become green"
        second = frame * FRAME_S
        assert player(scene, "--time", second, "--screenshot", tmp_path / "new.png").returncode == 0
        difference = np.abs(seen - pixels(tmp_path / "new.png"))
        assert (difference > 2).mean() < 0.001


def test_changed_settings_take_effect_without_a_new_upload(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene")
    with running(scene, tmp_path / "frames") as run:
        was = run.picture(0).mean()
        tree = json.loads((scene / "scene.json").read_text())
        tree["fog"] = {"color": [0.0, 0.0, 0.0], "density_per_m": 1.0}
        del tree["shadow"]
        tree["shadow"] = None
        publish(scene, tree)
        what, frame = run.swapped()
        assert what.startswith("0 of ")
        assert run.picture(frame).mean() < was / 2


UNKNOWN = '{"format": "paradize-scene", "version": 99}'


BROKEN = [("{", "is not valid JSON"), (UNKNOWN, "version: is 99")]


@pytest.mark.parametrize(("broken", "part"), sweep(BROKEN, test=BROKEN[:1]))
def test_a_broken_scene_gives_one_message_and_the_previous_one_stays(
    tmp_path: Path, broken: str, part: str
) -> None:
    scene = write_scene(tmp_path / "scene", bare=True)
    with running(scene, tmp_path / "frames") as run:
        run.picture(0)
        tree = recolored(scene, "green.ktx2", (10, 250, 10))
        aside = scene / "aside"
        aside.write_text(broken)
        aside.replace(scene / "scene.json")
        text = run.next_message()
        assert part in text and "the previous one stays" in text
        tree["artifacts"]["box_color"]["file"] = "none.ktx2"
        publish(scene, tree)
        assert "none.ktx2" in run.next_message()
        whole = (scene / "green.ktx2").read_bytes()
        (scene / "damaged.ktx2").write_bytes(whole[:-1] + b"?")
        tree["artifacts"]["box_color"]["file"] = "damaged.ktx2"
        publish(scene, tree)
        text = run.next_message()
        assert "damaged.ktx2: is damaged or was replaced" in text and "the previous one stays" in text
        tree["artifacts"]["box_color"]["file"] = "green.ktx2"
        publish(scene, tree)
        assert run.swapped()[0].startswith("1 of ")  # and there was no second message


def test_a_saved_and_baked_picture_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From a changed source through the bake to the player."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene, out = make_panel(tmp_path / "panel"), tmp_path / "out"
    with keeping_workers():
        assert not bake(scene, out).errors
        with running(out, tmp_path / "frames") as run:
            run.picture(0)
            write_image(scene.parent / "wood.png", np.full((64, 64, 3), [250, 10, 10], np.uint8))
            report = bake(scene, out)
            assert not report.errors
            what, frame = run.swapped()
            assert 1 <= int(what.split()[0]) <= report.count("baked")
            change = run.picture(frame).astype(int) - run.picture(frame - 1).astype(int)
            assert ((change[..., 0] - change[..., 1]) > 30).mean() > 0.05, "the wood did not become red"
