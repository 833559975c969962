"""Writes a small scene that bakes and plays at once, with the user's model framed and lit.

The folder is written under another name and then renamed, so it appears complete or not at all.
"""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import ceil, cos, log10, pi, sin
from pathlib import Path
from typing import TypeVar

from paradize.documents import toml_text
from paradize.errors import BakeError
from paradize.files import resolved
from paradize.kinds import kind_of, mend_of
from paradize.new.model import Model, copy_model, identifier
from paradize.new.sources import FACES, write_heightmap, write_sand, write_sky, write_vase
from paradize.new.views import FOV_DEG, Waypoint, lens_of, waypoints_of
from paradize.player_limits import DEPTH_RANGE
from paradize.readers.record import Vec3
from paradize.scene.reference import SCHEMA, schema_text
from paradize.store.atomic import PARTIAL, unwritten

WAYPOINTS = 8
Made = TypeVar("Made")


@dataclass(frozen=True)
class NewScene:
    """scene: the TOML. name: the scene's, as it has it. files: all that were written, seen from its folder.
    notes: what one should know. taken: what the model's cameras, lights and copies became. position, scale:
    where the model's origin stands, and how large the model is shown."""

    scene: Path
    name: str
    files: list[str]
    notes: list[str]
    taken: list[str] = field(default_factory=list)
    position: Vec3 = (0.0, 0.0, 0.0)
    scale: float = 1.0


def new_scene(folder: Path, model: Path | None = None) -> NewScene:
    """Makes `folder`, which must not exist or be empty, with a scene around a model (None: a vase).

    The model, the files beside it and its pictures are copied. Raises SourceError for a model that cannot be
    read, BakeError where the folder holds something or cannot be written.
    """

    def fill(aside: Path) -> tuple[str, Model]:
        (aside / "model").mkdir()
        copied = copy_model(model or write_vase(aside / "model"), aside)
        if model is None:
            copied.least_z = None  # of the vase, up is Y
        write_sky(aside / "sky", copied.sun.direction)
        write_heightmap(aside / "ground.png")
        write_sand(aside / "sand.png")
        return _toml(identifier(folder.name, "scene"), copied, aside), copied

    files, copied = new_folder(folder, fill)
    name, stands = identifier(folder.name, "scene"), (copied.position, copied.scale)
    return NewScene(resolved(folder) / "scene.toml", name, files, copied.notes, copied.taken, *stands)


def new_folder(folder: Path, fill: Callable[[Path], tuple[str, Made]]) -> tuple[list[str], Made]:
    """Makes `folder` with what `fill` writes into the folder that it gets, in which `sky` exists, and with
    the scene's text that it returns. Returns the names of all files, and what else `fill` returns.

    Raises BakeError where the folder holds something or cannot be written.
    """
    folder = resolved(folder)
    aside = folder.with_name(f".{folder.name[:40]}{PARTIAL}{secrets.token_hex(4)}")
    try:
        if folder.exists() and not folder.is_dir():
            raise BakeError(
                "is a file, not a folder",
                file=folder,
                mend=f"name a new folder; {mend_of(kind_of(folder), folder)}".rstrip("; "),
            )
        if folder.exists() and any(folder.iterdir()):
            raise BakeError("exists and is not empty", file=folder, mend="name a new folder")
        (aside / "sky").mkdir(parents=True)
        try:
            text, made = fill(aside)
            (aside / SCHEMA.name).write_text(schema_text(), encoding="utf-8")
            (aside / "scene.toml").write_text(text, encoding="utf-8")
            files = sorted(path.relative_to(aside).as_posix() for path in aside.rglob("*") if path.is_file())
            aside.rename(folder)
        except BaseException:
            shutil.rmtree(aside, ignore_errors=True)
            raise
    except OSError as error:
        raise unwritten(folder, error, "name another folder") from None
    return files, made


def _toml(name: str, model: Model, folder: Path) -> str:
    """The text of the scene. Lengths follow from r, the radius of the model as it is shown. Writes the files
    of instances, which stand relative to the model."""
    scale = model.scale
    r = scale * model.radius
    if scale != 1.0:
        model.notes.append(
            f"the model's radius is {model.radius:.3g} m: the scene shows it {scale:.3g} times as large"
        )
    lens = lens_of(model.views)
    away = 1.25 * r / sin(0.5 * min(lens.fov_deg, FOV_DEG) * pi / 180.0)
    side = 10.0 * away  # its half is how far cameras of the model may stand
    ground_error = 0.0004 * side
    middle = scale * (model.center[1] - model.foot)
    # the ground's mesh may hide what is thinner than its error, and a floor that lies no higher
    floor = middle if model.floor is None else min(middle, scale * model.floor)
    lift = max(2.0 * (ground_error - floor), 0.0)
    middle += lift
    origin = [_text(value, 1e-5 * r) for value in _origin(model, lift)]
    x, y, z = map(float, origin)  # as the file has it
    position = model.position = x, y, z
    model.write_instances(folder)

    def placed(point: Vec3) -> Vec3:
        x, y, z = (scale * value + offset for value, offset in zip(point, position, strict=True))
        return x, y, z

    farthest = 0.5 * side / scale
    cameras, notes = waypoints_of(model.views, lens, model.center, model.radius, farthest, placed)
    model.notes += [f"{model.parts[0].mesh}: {note}" for note in notes]
    if cameras:
        names = ", ".join(_shown(camera.camera) for camera in cameras)
        model.taken.append(f"the flight begins with the cameras of the model: {names}")
    if model.sun.light:
        model.taken.append(f"the sun is the light {_shown(model.sun.light)}")
    far = 1.5 * side
    near = min([0.02 * r, *(scale * camera.near for camera in cameras if camera.near is not None)])
    lines = [
        f"#:schema {SCHEMA.name}",
        "# A scene to start from. `paradize bake --help` names the page of all fields and their ranges.",
        "# Metres, Y up; -Z is north, +X east.",
        "",
        "[scene]",
        f"name = {toml_text(name)}",
        *([f"viewport = {list(lens.viewport)}"] if lens.viewport else []),
        "",
        *([f"# the light {_shown(model.sun.light)} of the model"] if model.sun.light else []),
        "[sun]",
        f"azimuth_deg = {_text(model.sun.azimuth_deg)}",
        f"elevation_deg = {_text(model.sun.elevation_deg)}",
        *([f"color = {_vector(model.sun.color)}"] if model.sun.color else []),
        *([f"intensity = {_text(model.sun.intensity)}"] if model.sun.intensity is not None else []),
        "",
        "[fog]",
        f"density_per_m = {_text(0.15 / side)}",
        "",
        "[sky]",
        "faces = [" + ", ".join(f'"sky/{face}.exr"' for face in FACES) + "]",
        "",
        "[shadow]",
        f"extent_m = {_text(6.0 * r)}",
        f"center = [0.0, {_text(middle)}, 0.0]",
        f"blur_distance_m = {_text(3.0 * away)}",
        "",
        "[terrain]",
        'heightmap = "ground.png"',
        f"size_m = [{_text(side)}, {_text(side)}]",
        f"height_m = {_text(0.08 * side)}",
        f"max_error_m = {_text(ground_error)}",
        'sand_color = "sand.png"',
        "sand_strength = 0.4",
        f"sand_repeat = {_text(40.0)}",
    ]
    lines += _objects(model, origin)
    if model.least_z is not None:
        x, y, z = model.center
        upright = _origin(replace(model, center=(x, z, -y), foot=model.least_z), lift)
        lines += [
            "# The file names no axis as up. If it is Z, write these two lines instead of the position:",
            f"# position = [{', '.join(_text(value, 1e-5 * r) for value in upright)}]",
            "# pitch_deg = -90.0",
        ]
    lines += [
        "",
        *(["# first what the cameras of the model see, perhaps across walls, then"] if cameras else []),
        "# once around the model, nearer and higher on the far side",
        "[flight]",
        "duration_s = 30.0",
        f"fov_deg = {_text(lens.fov_deg)}",
        f"near_m = {_text(max(near, far / DEPTH_RANGE, 1e-4))}",
        f"far_m = {_text(far)}",
    ]
    lines += _waypoints(cameras, middle, r, away)
    return "\n".join(lines) + "\n"


def _objects(model: Model, origin: list[str]) -> list[str]:
    """The lines of the model's objects. origin: where the model stands."""
    lines = []
    for part in model.parts:
        lines += ["", "[[object]]", f"name = {toml_text(part.name)}", f"mesh = {toml_text(part.mesh)}"]
        lines += [f"instances = {toml_text(part.table)}"] if part.table else []
        for material in part.cutouts:
            lines += ["", f"[object.material.{toml_text(material)}]", "two_sided = true"]
        if not part.table:
            lines += ["", "[[object.instance]]", f"position = [{', '.join(origin)}]"]
            lines += ["yaw_deg = 180.0"] if model.faces_back else []
            lines += [f"scale = {_text(model.scale)}"] if model.scale != 1.0 else []
    return lines


def _waypoints(cameras: list[Waypoint], middle: float, r: float, away: float) -> list[str]:
    """The lines of the flight's eyes and targets: those of the model's cameras, then a turn round the model,
    whose middle is so high. r: its radius, away: how far the eye is, in metres."""
    lines = []
    for camera in cameras:
        lines += ["", f"# the camera {_shown(camera.camera)}", "[[flight.eye]]"]
        lines += [f"position = {_vector(camera.eye)}"]
        lines += [f"roll_deg = {_text(camera.roll_deg)}"] if abs(camera.roll_deg) > 0.01 else []
    for i in range(WAYPOINTS):
        turn = 2.0 * pi * i / WAYPOINTS
        d = away * (1.0 - 0.15 * (1.0 - cos(turn)) / 2.0)
        height = middle + r * (0.35 + 0.3 * (1.0 - cos(turn)))
        eye = (_snapped(d * sin(turn), d), height, _snapped(d * cos(turn), d))
        lines += ["", "[[flight.eye]]", f"position = [{', '.join(_text(x) for x in eye)}]"]
    for camera in cameras:
        lines += ["", "[[flight.target]]", f"position = {_vector(camera.target)}"]
    for _ in range(WAYPOINTS):
        lines += ["", "[[flight.target]]", f"position = [0.0, {_text(middle)}, 0.0]"]
    return lines


def _origin(model: Model, lift: float) -> Vec3:
    """Where the scene shows the origin of the model, so that it stands `lift` above the ground."""
    turned = -1.0 if model.faces_back else 1.0
    x, _, z = (-turned * model.scale * value for value in model.center)
    return x, lift - model.scale * model.foot, z


def _snapped(value: float, size: float) -> float:
    """The value, or 0 if it is negligible compared with `size`."""
    return value if abs(value) > 1e-9 * size else 0.0


def _shown(name: str) -> str:
    """A name for a comment."""
    return repr(name[:80])


def _vector(values: Vec3) -> str:
    return f"[{', '.join(_text(value) for value in values)}]"


def _text(value: float, step: float | None = None) -> str:
    """A TOML float with five digits, or with more if `step` needs them."""
    digits = 5 if not step else min(17, max(5, ceil(log10(max(abs(value) / step, 1.0)))))
    text = f"{value + 0.0:.{digits}g}"
    return text if any(c in text for c in ".en") else f"{text}.0"
