"""The player's qualities: the time of a frame against the difference of its picture from a reference.

The reference is what `paradize-player --reference N` draws: the mean of N jittered frames with everything at
its finest. It is drawn from a folder of its own: baked exact, its textures uncompressed, with all mips and
all of the terrain. So every error includes what the bake lost. The formats of textures cost the player time
as well: other bakes of the scene are the group "texture format"."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from paradize.data import rounded
from paradize.documents import SCENE_FILE, parse_json
from paradize.formats.scene.manifest import read_scene
from paradize.jobs.progress import OnProgress
from paradize.metrics.picture import Picture, flip_errors
from paradize.preview.player import read_picture, run_player
from paradize.tiers import TIERS
from paradize.tradeoff.curve import Group, Point, spread

SIZE = (320, 180)  # pixels
MOMENTS = 3  # seconds of the flight
FRAMES = 6  # timed at each
SAMPLES = 16  # frames that a reference averages
_PATIENCE_S = 600.0
_QUALITY = "All other features balanced; maps and meshes in the tiers in use."
_STORED = "Bytes: the whole scene in GPU memory."


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
    on_progress: OnProgress | None = None,
) -> Iterator[Group]:
    """A group for each quality feature of the scene, with a point for each of its qualities while the other
    features are balanced. Each group comes as soon as it is measured.

    player: the program. folder: a baked scene. reference: the same scene baked without loss; None: `folder`.
    variants: other bakes of it, by tier, for the group "texture format"; used: the tier of `folder`. seconds:
    of the flight, at which frames are drawn and compared; None: MOMENTS, evenly spaced. size: of the picture,
    pixels. frames: timed at each second, each until the GPU has finished it. samples: frames that the
    reference averages. The groups have no conclusions yet. Raises BakeError if the player fails."""
    scene = read_scene(folder / SCENE_FILE)
    duration_s = float(scene["flight"]["duration_s"])
    moments = [duration_s * (i + 0.5) / MOMENTS for i in range(MOMENTS)] if seconds is None else list(seconds)
    with TemporaryDirectory(prefix="paradize-player-trade-") as name:
        run = _Player(player, size, moments, frames, samples, Path(name))
        features = run.features(folder)
        bakes = dict(variants or {})
        total = 2 + len(features) * (len(TIERS) - 1) + len(bakes)
        done = 0

        def begin(step: str) -> None:
            nonlocal done
            if on_progress:
                on_progress(step, done, total)
            done += 1

        begin(f"the reference of {samples} frames")
        truth = run.pictures(reference or folder, "--reference", str(samples))
        begin("every feature balanced")
        middle = run.point(folder, "balanced", truth, in_use=True)
        for feature in features:
            points = []
            for tier in TIERS:
                if tier == "balanced":
                    points.append(middle)
                    continue
                begin(f"{feature} {tier}")
                points.append(run.point(folder, tier, truth, "--quality", f"{feature}={tier}"))
            yield _group(feature, str(scene["name"]), points) | {"note": _QUALITY}
        if bakes:
            points = [middle | {"tier": used, "bytes": run.resident(folder)}]
            for tier, baked in bakes.items():
                begin(f"textures {tier}")
                points.append(run.point(baked, tier, truth) | {"bytes": run.resident(baked)})
            order = {tier: at for at, tier in enumerate(TIERS)}
            points.sort(key=lambda point: order.get(point["tier"], len(order)))
            yield _group("texture format", str(scene["name"]), points) | {"note": _STORED}
        if on_progress:
            on_progress("done", total, total)


class _Player:
    """Runs the player with one size of picture, at the same seconds each time."""

    def __init__(
        self,
        program: Path,
        size: tuple[int, int],
        moments: Sequence[float],
        frames: int,
        samples: int,
        scratch: Path,
    ) -> None:
        self.program, self.moments, self.frames, self.samples = program, moments, frames, samples
        self.size = f"{size[0]}x{size[1]}"
        self.scratch = scratch

    def features(self, folder: Path) -> list[str]:
        """The quality features that have an effect on this device, in the player's order."""
        return [str(name) for name in self._json(folder, 0.0, "--frames", "1")["features"]]

    def resident(self, folder: Path) -> int:
        """Bytes of the whole scene in GPU memory."""
        return int(self._json(folder, 0.0, "--frames", "1", "--wait-resident")["resident_bytes"])

    def pictures(self, folder: Path, *options: str) -> list[Picture]:
        """The pictures at each second, (h, w, 3) float32, sRGB 0..1."""
        drawn = []
        for second in self.moments:
            file = self.scratch / "picture.png"
            self._json(folder, second, "--screenshot", str(file), *options)
            drawn.append(read_picture(file))
            file.unlink()
        return drawn

    def point(
        self, folder: Path, tier: str, truth: Sequence[Picture], *options: str, in_use: bool = False
    ) -> Point:
        """Frame time and error of one quality."""
        bench = ("--bench", "--frames", str(self.frames), *options)
        runs = [self._json(folder, second, *bench)["bench"]["frames_ms"] for second in self.moments]
        # A frame is the mean over the moments: they differ by what they show, not by chance.
        times = [rounded(sum(frame) / len(frame) * 1e-3) for frame in zip(*runs, strict=True)]
        errors = flip_errors(truth, self.pictures(folder, *options))
        return {
            "tier": tier,
            "seconds": spread(times),
            "error": {"value": rounded(errors["mean"])}
            | {name: rounded(error) for name, error in errors.items()},
            "bytes": None,
            "in_use": in_use,
            "dominated": False,
            "on_front": False,
        }

    def _json(self, folder: Path, second: float, *options: str) -> dict[str, Any]:
        at = ("--size", self.size, "--json", "--time", f"{second:g}")
        printed = run_player(self.program, folder, *at, *options, timeout_s=_PATIENCE_S)
        tree: dict[str, Any] = parse_json(printed.encode(), self.program)
        return tree


def _group(feature: str, artifact: str, points: list[Point]) -> Group:
    return {
        "name": feature,
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
