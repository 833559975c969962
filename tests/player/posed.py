"""Renders a baked scene from other camera poses and with other settings."""

from __future__ import annotations

import copy
import json
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.pictures import load
from tests.player.synthetic import identity

WIDTH, HEIGHT = 320, 180
FOV_RAD = 0.9
Vec = tuple[float, float, float]
Picture = NDArray[np.float32]


@dataclass
class Posed:
    """Renders one scene repeatedly. Pictures are cached."""

    source: Path
    player: Callable[..., Any]
    folder: Path
    objects: frozenset[str] = frozenset()  # what stands in its scene: empty for all
    size: tuple[int, int] = (WIDTH, HEIGHT)  # of its pictures
    kept: dict[str, list[Picture]] = field(default_factory=dict)

    def scene(self) -> dict[str, Any]:
        """A copy of its scene.json, for changes. Its light stands still, as at its poster's key."""
        scene: dict[str, Any] = json.loads((self.source / "scene.json").read_text())
        scene["daytime"] = None
        if self.objects:
            scene["objects"] = [item for item in scene["objects"] if item["name"] in self.objects]
        return scene

    def render(self, eye: Vec, target: Vec, **options: Any) -> Picture:
        """(h, w, 3) float32 in 0..1, sRGB-encoded, from `eye` to `target`. options: those of `views`."""
        (picture,) = self.views([(eye, target)], **options)
        return picture

    def play(self, eye: Vec, target: Vec, frames: int, **options: Any) -> list[Picture]:
        return self.views([(eye, target)] * frames, **options)

    def views(
        self,
        poses: Sequence[tuple[Vec, Vec]],
        *,
        disable: str = "",
        quality: str = "balanced",
        time_s: float = 0.0,
        scene: dict[str, Any] | None = None,
        files: dict[str, bytes] | None = None,
    ) -> list[Picture]:
        """Pictures of one start of the player, each from its pose, 1/30 s apart, from `time_s` on. Every
        value is checked to be finite before it is encoded. `files` replaces artifacts by name."""
        manifest = self.scene() if scene is None else copy.deepcopy(scene)
        duration_s, frames = manifest["flight"]["duration_s"], len(poses)
        manifest["flight"] |= {
            "fov_rad": FOV_RAD,
            "segments": [
                {
                    "eye": [[v, 0.0, 0.0, 0.0] for v in eye],
                    "target": [[v, 0.0, 0.0, 0.0] for v in target],
                    "roll": [0.0, 0.0, 0.0, 0.0],
                }
                for eye, target in poses
            ],
            "time_table": [[0.0, 0.0, 1.0 / duration_s], [duration_s, frames, 1.0 / duration_s]],
        }
        if frames > 1:  # each in the middle of its segment
            knots = [[time_s + i / 30, i + 0.5, 0.0] for i in range(frames)]
            begin = [] if time_s == 0.0 else [[0.0, 0.0, 0.0]]
            manifest["flight"]["time_table"] = [*begin, *knots, [duration_s, frames, 0.0]]
        if "waypoint_u" in manifest["flight"]:
            manifest["flight"]["waypoint_u"] = [0]
        size = "x".join(map(str, self.size))
        replaced = {name: identity(data) for name, data in (files or {}).items()}
        key = json.dumps([manifest, disable, quality, time_s, size, frames, replaced], sort_keys=True)
        if key in self.kept:
            return self.kept[key]
        # One folder for all scenes without other files: the player checks its files once.
        room = Path(tempfile.mkdtemp(dir=self.folder)) if files else self.folder / "scene"
        room.mkdir(exist_ok=True)
        for name, artifact in manifest["artifacts"].items():
            place = room / artifact["file"]
            if files and name in files:
                place.write_bytes(files[name])
                artifact |= replaced[name]
            elif not place.exists():
                place.symlink_to((self.source / artifact["file"]).resolve())
        (room / "scene.json").write_text(json.dumps(manifest))
        out = room / "picture.png"
        arguments: list[object] = [room, "--time", time_s, "--size", size]
        arguments += ["--screenshot", out, "--check-finite", "--debug", "--quality", quality]
        if disable:
            arguments += ["--disable", disable]
        if frames > 1:
            arguments += ["--frames", frames, "--wait-resident"]
        result = self.player(*arguments)
        assert result.returncode == 0, result.stderr
        files_out = [out] if frames == 1 else [room / f"picture_{i:04}.png" for i in range(frames)]
        self.kept[key] = [load(file) for file in files_out]
        return self.kept[key]


def pixel(eye: Vec, target: Vec, point: Vec, size: tuple[int, int] = (WIDTH, HEIGHT)) -> tuple[float, float]:
    """(x, y) in pixels, row 0 at the top, of a world point in a picture from `eye` to `target`."""
    width, height = size
    forward = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    ray = np.subtract(point, eye)
    scale = 0.5 * height / np.tan(0.5 * FOV_RAD) / float(ray @ forward)
    return width / 2 + float(ray @ right) * scale, height / 2 - float(ray @ up) * scale


def differs(a: Picture, b: Picture, threshold: float = 6.0 / 255.0) -> NDArray[np.bool_]:
    """(h, w): where two pictures differ by more than the threshold in any channel."""
    return np.asarray(np.abs(a - b).max(axis=2) > threshold)


def around(mask: NDArray[Any], x: float, y: float, radius: int) -> NDArray[Any]:
    """The square of a picture around a pixel."""
    left, top = max(round(x) - radius, 0), max(round(y) - radius, 0)
    return mask[top : round(y) + radius + 1, left : round(x) + radius + 1]
