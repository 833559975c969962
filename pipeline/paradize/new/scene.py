"""Writes a small scene that bakes and plays at once, with the user's model framed and lit.

The folder is written under another name and then renamed, so it appears complete or not at all.
"""

from __future__ import annotations

import glob
import secrets
import shutil
from dataclasses import dataclass, field
from math import ceil, cos, log10, pi, sin, sqrt
from pathlib import Path

from paradize.build.model_facts import tiles_of
from paradize.build.udim import MEND, udim_fault
from paradize.documents import toml_text
from paradize.errors import BakeError, SourceError
from paradize.files import read_parts, resolved
from paradize.kinds import is_gltf
from paradize.material import Material
from paradize.new.floors import least_floor
from paradize.new.sources import FACES, write_heightmap, write_sand, write_sky, write_vase
from paradize.new.views import FOV_DEG, Sun, lens_of, sun_of, waypoints_of
from paradize.readers.model import read_model
from paradize.readers.record import Model as ReadModel
from paradize.readers.record import Vec3, Views
from paradize.scene.reference import SCHEMA, schema_text
from paradize.store.atomic import PARTIAL

LEAST_M, MOST_M = 0.05, 500.0  # a model with a radius outside these is scaled towards one metre
SCALES = (1e-6, 1e6)  # limits of an instance's scale (scene/settings/objects.py)
SMALLEST, LARGEST, FARTHEST = 1e-8, 1e9, 1e9  # limits of a model's radius; of its distance from 0, in radii
FARTHEST_M = 1e9  # limit of an instance's position (scene/settings/objects.py)
WAYPOINTS = 8
PICTURES = {".png", ".jpg", ".jpeg", ".tga", ".tif", ".tiff", ".exr"}
RESERVED = {"terrain", "sand", "effect", "water", "sky", "sound"}


@dataclass(frozen=True)
class NewScene:
    """scene: the TOML. name: the scene's, as it has it. files: all that were written, seen from its folder.
    notes: what one should know. taken: what the model's cameras and lights became."""

    scene: Path
    name: str
    files: list[str]
    notes: list[str]
    taken: list[str] = field(default_factory=list)


@dataclass
class _Model:
    """The object made from the model, and its size in the units of the file. cutouts: materials with
    holes. floor: how far above its foot its lowest floor lies."""

    name: str = ""
    mesh: str = ""
    cutouts: tuple[str, ...] = ()
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    foot: float = 0.0
    floor: float | None = None
    radius: float = 1.0
    sun: Sun = field(default_factory=Sun)
    views: Views | None = None
    taken: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def new_scene(folder: Path, model: Path | None = None) -> NewScene:
    """Makes `folder`, which must not exist or be empty, with a scene around a model (None: a vase).

    The model, the files beside it and its pictures are copied. Raises SourceError for a model that cannot be
    read, BakeError where the folder holds something or cannot be written.
    """
    folder = resolved(folder)
    aside = folder.with_name(f".{folder.name[:40]}{PARTIAL}{secrets.token_hex(4)}")
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise BakeError("is there and not empty", file=folder, mend="name a new folder")
        (aside / "sky").mkdir(parents=True)
        (aside / "model").mkdir()
        try:
            copied = _copy_model(model or write_vase(aside / "model"), aside)
            write_sky(aside / "sky", copied.sun.direction)
            write_heightmap(aside / "ground.png")
            write_sand(aside / "sand.png")
            name = _identifier(folder.name, "scene")
            (aside / SCHEMA.name).write_text(schema_text(), encoding="utf-8")
            (aside / "scene.toml").write_text(_toml(name, copied), encoding="utf-8")
            files = sorted(path.relative_to(aside).as_posix() for path in aside.rglob("*") if path.is_file())
            aside.rename(folder)
        except BaseException:
            shutil.rmtree(aside, ignore_errors=True)
            raise
    except OSError as error:
        what = f"cannot be written: {error.strerror or error}"
        raise BakeError(what, file=folder, mend="free the place or name another folder") from None
    return NewScene(folder / "scene.toml", name, files, copied.notes, copied.taken)


def _identifier(text: str, otherwise: str) -> str:
    """A name that a scene accepts: a-z, 0-9 and _, a letter first, at most 40."""
    kept = "".join(c if c.isascii() and c.isalnum() else "_" for c in text.lower()).strip("_")[:40]
    if kept and not kept[0].isalpha():
        kept = f"{otherwise}_{kept}"[:40]
    return kept or otherwise


def _copy_model(source: Path, aside: Path) -> _Model:
    """Copies the model and its files into aside/model, and measures it."""
    read = read_model(source)
    folder, root = aside / "model", resolved(source).parent
    _refuse_udim(source, read)
    maps = {path for material in read.materials.values() for path in _pictures_of(material)}
    for path in {resolved(source), *read.libraries, *read.unread, *maps}:
        target = folder / resolved(path).relative_to(root)
        target.parent.mkdir(parents=True, exist_ok=True)
        if not (target.exists() and target.samefile(path)):
            with target.open("wb") as copy:
                copy.writelines(read_parts(path))
    places = read.mesh.absolute_positions
    low, high = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    half = [0.5 * (b - a) for a, b in zip(low, high, strict=True)]
    model = _Model(
        center=(low[0] + half[0], low[1] + half[1], low[2] + half[2]),
        foot=low[1],
        floor=least_floor(read.mesh),
        radius=sqrt(sum(h * h for h in half)),
        sun=sun_of(read.views),
        views=read.views,
        notes=list(read.warnings),
    )
    if read.views:
        model.notes += read.views.notes
        model.notes += [f"{source}: {note}" for note in model.sun.notes]
    if not SMALLEST <= model.radius <= LARGEST:
        what = f"its radius is {model.radius:g}; a scene can show {SMALLEST:g} to {LARGEST:g}"
        raise SourceError(what, file=source, mend="scale the model")
    away = max(abs(c) for c in model.center)
    limit = min(FARTHEST * model.radius, FARTHEST_M / _scale(model.radius))
    if away > limit:
        what = f"it lies {away:g} from the origin, limit {limit:g} of a radius of {model.radius:g}"
        raise SourceError(what, file=source, mend="move the model nearer to the origin")
    if not read.libraries and not is_gltf(source):
        model.notes.append(
            _white(source, "in its vertex colours" if read.mesh.colors is not None else "white")
        )
    stem = _identifier(source.stem, "model")
    model.name = f"{stem}_model"[:40] if stem in RESERVED else stem
    model.mesh = f"model/{source.name}"
    used = dict.fromkeys(group.material for group in read.mesh.groups)
    model.cutouts = tuple(name for name in used if _is_cut(read.materials.get(name)))
    return model


def _refuse_udim(source: Path, read: ReadModel) -> None:
    """Raises SourceError for a model whose pictures are UDIM tiles."""
    for name in dict.fromkeys(group.material for group in read.mesh.groups):
        maps = read.materials[name].maps if name in read.materials else {}
        if what := udim_fault(maps, tiles_of(read.mesh.of_materials([name])), read.absent):
            raise SourceError(what, file=source, place=f"material {name!r}", mend=MEND)


def _is_cut(material: Material | None) -> bool:
    """Whether a picture cuts holes into a material, so that its back faces show."""
    return material is not None and "alpha" in material.maps and material.two_sided is None


def _white(source: Path, shown: str) -> str:
    """Says how a model without a material file is shown, and which picture may be its colour map."""
    near = sorted(source.parent.glob(f"{glob.escape(source.stem)}*"))
    picture = next((path.name for path in near if path.suffix.lower() in PICTURES), "PICTURE")
    write = f"copy {picture} beside scene.toml and write color = {toml_text(picture)} under [[object]]"
    return f"{source}: has no material file, so it is drawn {shown}; for a colour map {write}"


def _pictures_of(material: Material) -> list[Path]:
    return [source.picture.file for source in material.maps.values()]


def _toml(name: str, model: _Model) -> str:
    """The text of the scene. Lengths follow from r, the radius of the model as it is shown."""
    scale = _scale(model.radius)
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
    position = (-scale * model.center[0], lift - scale * model.foot, -scale * model.center[2])

    def placed(point: Vec3) -> Vec3:
        x, y, z = (scale * value + offset for value, offset in zip(point, position, strict=True))
        return x, y, z

    farthest = 0.5 * side / scale
    cameras, notes = waypoints_of(model.views, lens, model.center, model.radius, farthest, placed)
    model.notes += [f"{model.mesh}: {note}" for note in notes]
    if cameras:
        names = ", ".join(_shown(one.camera) for one in cameras)
        model.taken.append(f"the flight begins with the cameras of the model: {names}")
    if model.sun.light:
        model.taken.append(f"the sun is the light {_shown(model.sun.light)}")
    lines = [
        f"#:schema {SCHEMA.name}",
        "# A scene to start from. All fields, defaults, units and ranges: pipeline/paradize/scene/FIELDS.md.",
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
    lines += ["", "[[object]]", f"name = {toml_text(model.name)}", f"mesh = {toml_text(model.mesh)}"]
    for material in model.cutouts:
        lines += ["", f"[object.material.{toml_text(material)}]", "two_sided = true"]
    lines += ["", "[[object.instance]]", f"position = [{', '.join(_text(x, 1e-5 * r) for x in position)}]"]
    lines += [f"scale = {_text(scale)}"] if scale != 1.0 else []
    lines += [
        "",
        *(["# first what the cameras of the model see, then"] if cameras else []),
        "# once around the model, nearer and higher on the far side",
        "[flight]",
        "duration_s = 30.0",
        f"fov_deg = {_text(lens.fov_deg)}",
        f"near_m = {_text(max(0.02 * r, 1e-4))}",
        f"far_m = {_text(1.5 * side)}",
    ]
    for one in cameras:
        lines += ["", f"# the camera {_shown(one.camera)}", "[[flight.eye]]"]
        lines += [f"position = {_vector(one.eye)}"]
        lines += [f"roll_deg = {_text(one.roll_deg)}"] if abs(one.roll_deg) > 0.01 else []
    for i in range(WAYPOINTS):
        turn = 2.0 * pi * i / WAYPOINTS
        d = away * (1.0 - 0.15 * (1.0 - cos(turn)) / 2.0)
        height = middle + r * (0.35 + 0.3 * (1.0 - cos(turn)))
        eye = (_snapped(d * sin(turn), d), height, _snapped(d * cos(turn), d))
        lines += ["", "[[flight.eye]]", f"position = [{', '.join(_text(x) for x in eye)}]"]
    for one in cameras:
        lines += ["", "[[flight.target]]", f"position = {_vector(one.target)}"]
    for _ in range(WAYPOINTS):
        lines += ["", "[[flight.target]]", f"position = [0.0, {_text(middle)}, 0.0]"]
    return "\n".join(lines) + "\n"


def _scale(radius: float) -> float:
    """The scale at which a model of this radius is shown."""
    return 1.0 if LEAST_M <= radius <= MOST_M else min(max(1.0 / radius, SCALES[0]), SCALES[1])


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
