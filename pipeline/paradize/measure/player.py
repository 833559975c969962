"""The player's own trade: the time of a frame against how far the picture is from the reference.

The reference is what `paradize-player --reference N` draws: the mean of N jittered frames with everything at
its finest. It comes from another folder than what is played: baked exact, its textures uncompressed, with all
mips and all of the terrain. So what the bake lost is part of every error. How textures are stored is the
bake's trade, but the player pays for it: other bakes of the scene are drawn as the group "texture format".
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from paradize.data import six
from paradize.documents import SCENE_FILE, parse_json
from paradize.errors import BakeError
from paradize.files import open_file
from paradize.formats.scene_manifest import read_scene
from paradize.measure.curve import Group, Point, spread
from paradize.metrics.picture import Picture, flip_errors

TIERS = ("fast", "balanced", "exact")
SIZE = (320, 180)  # pixels
MOMENTS = 3  # seconds of the flight
FRAMES = 6  # timed at each
SAMPLES = 16  # frames that a reference averages
_PATIENCE_S = 600.0
_QUALITY = "All other trades balanced; maps and meshes are those of the tiers in use."
_STORED = "Bytes are those of the whole scene on the device."

Told = Callable[[str, int, int], None]  # what runs, how many are done, of how many


def player_groups(
    player: Path,
    folder: Path,
    *,
    reference: Path | None = None,
    variants: Mapping[str, Path] | None = None,
    used: str = "balanced",
    seconds: Sequence[float] | None = None,
    size: tuple[int, int] = SIZE,
    frames: int = FRAMES,
    samples: int = SAMPLES,
    told: Told | None = None,
) -> Iterator[Group]:
    """A group for each trade that the scene has, with a point for each quality, the other trades balanced;
    each as soon as it is measured.

    player: the program. folder: a baked scene. reference: the same scene baked without loss; None: `folder`.
    variants: other bakes of it, by tier, for the group "texture format"; used: the tier of `folder`.
    seconds: of the flight, at which frames are drawn and compared; None: MOMENTS, evenly over it. size: of
    the picture, pixels. frames: timed at each second, each until the device has finished it. samples: frames
    that a reference averages. Groups are not judged yet. Raises BakeError where the player fails.
    """
    scene = read_scene(folder / SCENE_FILE)
    duration_s = float(scene["flight"]["duration_s"])
    moments = [duration_s * (i + 0.5) / MOMENTS for i in range(MOMENTS)] if seconds is None else list(seconds)
    with TemporaryDirectory(prefix="paradize-player-trade-") as name:
        run = _Player(player, size, moments, frames, samples, Path(name))
        trades = run.trades(folder)
        bakes = dict(variants or {})
        total = 2 + len(trades) * (len(TIERS) - 1) + len(bakes)
        done = 0

        def tell(what: str) -> None:
            nonlocal done
            if told:
                told(what, done, total)
            done += 1

        tell(f"the reference of {samples} frames")
        truth = run.pictures(reference or folder, "--reference", str(samples))
        tell("every trade balanced")
        middle = run.point(folder, "balanced", truth, in_use=True)
        for trade in trades:
            points = []
            for tier in TIERS:
                if tier == "balanced":
                    points.append(middle)
                    continue
                tell(f"{trade} {tier}")
                points.append(run.point(folder, tier, truth, "--quality", f"{trade}={tier}"))
            yield _group(trade, str(scene["name"]), points) | {"note": _QUALITY}
        if bakes:
            points = [middle | {"tier": used, "bytes": run.resident(folder)}]
            for tier, place in bakes.items():
                tell(f"textures {tier}")
                points.append(run.point(place, tier, truth) | {"bytes": run.resident(place)})
            order = {tier: at for at, tier in enumerate(TIERS)}
            points.sort(key=lambda point: order.get(point["tier"], len(order)))
            yield _group("texture format", str(scene["name"]), points) | {"note": _STORED}
        if told:
            told("done", total, total)


class _Player:
    """Runs the player on folders, always with the same size and at the same seconds."""

    def __init__(
        self,
        program: Path,
        size: tuple[int, int],
        moments: Sequence[float],
        frames: int,
        samples: int,
        room: Path,
    ) -> None:
        self.program, self.moments, self.frames, self.samples = program, moments, frames, samples
        self.size = f"{size[0]}x{size[1]}"
        self.room = room

    def trades(self, folder: Path) -> list[str]:
        """Names of the player's trades that do something on this device, in the player's order."""
        told = self._json(folder, 0.0, "--frames", "1")
        return [str(name) for name in told["trades"]]

    def resident(self, folder: Path) -> int:
        """Bytes of the scene on the device, all of it."""
        return int(self._json(folder, 0.0, "--frames", "1", "--wait-resident")["resident_bytes"])

    def pictures(self, folder: Path, *options: str) -> list[Picture]:
        """What it draws at each second, (h, w, 3) float32, sRGB 0..1."""
        from PIL import Image

        found = []
        for second in self.moments:
            file = self.room / "picture.png"
            self._json(folder, second, "--screenshot", str(file), *options)
            with open_file(file) as stream, Image.open(stream) as image:
                found.append(np.asarray(image.convert("RGB"), np.float32) / np.float32(255))
            file.unlink()
        return found

    def point(
        self, folder: Path, tier: str, truth: Sequence[Picture], *options: str, in_use: bool = False
    ) -> Point:
        """Frame time and error of one quality."""
        timed = ("--bench", "--frames", str(self.frames), *options)
        runs = [self._json(folder, second, *timed)["bench"]["frames_ms"] for second in self.moments]
        # Moments differ by what they show, not by chance: a frame is the mean over them.
        times = [six(sum(frame) / len(frame) * 1e-3) for frame in zip(*runs, strict=True)]
        errors = flip_errors(truth, self.pictures(folder, *options))
        return {
            "tier": tier,
            "seconds": spread(times),
            "error": {"value": six(errors["mean"])} | {name: six(error) for name, error in errors.items()},
            "bytes": None,
            "in_use": in_use,
            "dominated": False,
            "on_front": False,
        }

    def _json(self, folder: Path, second: float, *options: str) -> dict[str, Any]:
        command = [str(self.program), str(folder), "--headless", "--mute", "--size", self.size, "--json"]
        try:
            ran = subprocess.run(
                [*command, "--time", f"{second:g}", *options],
                check=True,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=_PATIENCE_S,
            )
        except subprocess.CalledProcessError as failed:
            words = failed.stderr.strip().splitlines()
            raise BakeError(f"drew nothing: {words[-1] if words else failed}", file=self.program) from None
        except (OSError, subprocess.TimeoutExpired) as failed:
            raise BakeError(f"drew nothing: {failed}", file=self.program) from None
        told: dict[str, Any] = parse_json(ran.stdout.encode(), self.program)
        return told


def _group(trade: str, artifact: str, points: list[Point]) -> Group:
    return {
        "name": trade,
        "stage": "player",
        "kind": "frame",
        "artifact": artifact,
        "metric": "flip_mean",
        "unit": "FLIP",
        "less_is_better": True,
        "time": "frame",
        "points": points,
        "budget": None,
        "sentence": "",
    }
