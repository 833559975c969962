"""Rules for a baked scene: its manifest, its files, its budget, its camera path."""

from __future__ import annotations

import errno
import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any

from paradize.artifact import FILE_NAME
from paradize.checks.against import WORSE_BY, check_against, earlier_scene
from paradize.checks.budgets import check_budget
from paradize.checks.flights import check_flight
from paradize.checks.gutters import check_gutters
from paradize.checks.inside_out import check_winding
from paradize.checks.layouts import check_layouts
from paradize.checks.lights import check_lights
from paradize.checks.maps import scene_maps
from paradize.checks.meshes import check_mesh
from paradize.checks.rules import Finding, isolated
from paradize.checks.skies import check_sky
from paradize.checks.sounds import check_sound
from paradize.checks.terrain import check_tiles
from paradize.checks.textures import check_texture
from paradize.checks.verdicts import apply_scene
from paradize.errors import FormatError, mend_of_reading
from paradize.formats.glb.reader import decode_glb
from paradize.formats.glb.tiles import decode_tile
from paradize.formats.scene.manifest import read_entry, read_scene, references
from paradize.jobs.progress import OnProgress
from paradize.map_table import MAPS

_JUMP = 1e-6  # of the segment's size: how far apart the ends of two segments may be


@dataclass(frozen=True)
class CheckOptions:
    """against: the folder of an earlier bake. worse_by: the share by which an error may have grown since.
    today: decides which waivers have ended. on_progress: hears of every artifact and every search. checked:
    takes the name of each artifact that was looked at. scenes: takes how many files each scene names whose
    settings were looked at; None where they have faults. without_budget: takes each scene.json whose scene
    limits no error."""

    against: Path | None = None
    worse_by: float = WORSE_BY
    today: date = field(default_factory=date.today)
    on_progress: OnProgress | None = None
    checked: set[str] = field(default_factory=set, compare=False)
    scenes: dict[str, int | None] = field(default_factory=dict, compare=False)
    without_budget: list[str] = field(default_factory=list, compare=False)

    def begin(self, step: str, done: int, total: int) -> None:
        """Reports a step to on_progress."""
        if self.on_progress:
            self.on_progress(step, done, total)


def check_scene(path: Path, options: CheckOptions) -> Iterator[Finding]:
    """The findings in a scene.json and in everything that it names, with the severities and waivers of the
    scene."""
    file = str(path)
    try:
        manifest = read_scene(path)
    except OSError as error:
        yield Finding("PZ101", file, error.strerror or str(error), mend=_mend(error))
        return
    except FormatError as error:
        yield Finding("PZ102", file, error.what, error.place or "")
        return
    if not any(manifest["budget"].values()):
        options.without_budget.append(file)
    owners = {str(path.parent / entry["file"]): name for name, entry in manifest["artifacts"].items()}
    findings = (
        finding if finding.artifact else replace(finding, artifact=owners.get(finding.file, ""))
        for finding in _findings(manifest, path, options)
    )
    names = ["flight", "scene"]
    names += [name for key, entry in manifest["artifacts"].items() for name in (key, *entry["also"])]
    yield from apply_scene(findings, manifest["check"], file, options.today, names)


def _findings(manifest: dict[str, Any], path: Path, options: CheckOptions) -> Iterator[Finding]:
    file = str(path)
    colors = _colors(manifest)
    tiles = manifest["terrain"]["tiles"] if manifest["terrain"] else []
    folder = path.parent
    placed = {sound["artifact"] for sound in manifest["sounds"] if sound["places"]}
    searches = {"budget": check_budget(manifest, folder, file)}
    if options.against:
        earlier = earlier_scene(options.against, folder)
        searches["earlier bake"] = check_against(manifest, earlier, file, options.worse_by)
    searches |= {
        "UV layouts": check_layouts(manifest, folder),
        "winding": check_winding(manifest, folder),
        "gutters": check_gutters(manifest, folder),
        "maps": scene_maps(manifest, folder),
        "terrain": check_tiles(manifest, folder),
        "lights": check_lights(manifest, file),
        "sky": check_sky(manifest, folder, file),
        "unused files": _unused(folder, manifest, file),
        "path": _path(manifest["flight"], file),
        "flight": check_flight(manifest, folder, file),
    }
    total = len(manifest["artifacts"]) + len(searches)
    for done, (name, artifact) in enumerate(manifest["artifacts"].items()):
        options.begin(name, done, total)
        options.checked.add(str(folder / artifact["file"]))
        decode = decode_tile if name in tiles else decode_glb
        findings = _artifact(folder, name, artifact, colors.get(name), decode, name in placed)
        yield from isolated(findings, str(folder / artifact["file"]))
    for done, (name, search) in enumerate(searches.items(), len(manifest["artifacts"])):
        options.begin(name, done, total)
        yield from isolated(search, file)


def _mend(error: OSError) -> str:
    """Advice for a file that cannot be read, if its rule gives none."""
    return "move it away, then bake again" if error.errno == errno.EISDIR else mend_of_reading(error) or ""


def _colors(manifest: dict[str, Any]) -> dict[str, bool]:
    """Which textures hold colours, from the fields that name them."""
    srgb = tuple(name for name, material_map in MAPS.items() if material_map.kind == "color")
    return {
        name: place.endswith(srgb) for place, name, kinds in references(manifest) if kinds == ("texture",)
    }


def _artifact(
    folder: Path,
    name: str,
    artifact: dict[str, Any],
    color: bool | None,
    decode: Callable[[bytes, object], object],
    placed: bool,
) -> Iterator[Finding]:
    path = folder / artifact["file"]
    file = str(path)
    try:
        data = read_entry(folder, artifact)
    except OSError as error:
        if error.errno == errno.EFBIG:
            what = f"{error.strerror}: those that scene.json names"
            yield Finding("PZ103", file, what, name, artifact=name)
        else:
            what = f"the file of {name} cannot be read: {error.strerror or error}"
            yield Finding("PZ101", file, what, mend=_mend(error))
        return
    sha256 = hashlib.sha256(data).hexdigest()
    if len(data) != artifact["bytes"]:
        what = f"{len(data)} bytes where scene.json names {artifact['bytes']}"
        yield Finding("PZ103", file, what, name, artifact=name)
    elif sha256 != artifact["sha256"]:
        what = f"SHA-256 {sha256[:12]}... where scene.json names {artifact['sha256'][:12]}..."
        yield Finding("PZ103", file, what, name, artifact=name)
    if artifact["kind"] == "mesh":
        findings = list(check_mesh(data, file))
        yield from findings
        if not any(finding.severity == "error" for finding in findings):
            try:
                decode(data, file)
            except FormatError as error:
                yield Finding("PZ102", file, error.what, error.place or "")
    elif artifact["kind"] in ("texture", "cubemap"):
        yield from check_texture(data, file, color=color, last=artifact["max_level"])
    else:
        yield from check_sound(data, file, placed=placed)


def _unused(folder: Path, manifest: dict[str, Any], file: str) -> Iterator[Finding]:
    named = {artifact["file"] for artifact in manifest["artifacts"].values()}
    for path in sorted(folder.iterdir()):
        if FILE_NAME.fullmatch(path.name) and path.name not in named:
            yield Finding("PZ104", str(path), "is not named by scene.json")
    read = {name for place, name, _ in references(manifest) if not place.startswith("streaming")}
    for name in manifest["artifacts"]:
        if name not in read:
            what = f"{name} is read by no pass"
            yield Finding("PZ402", file, what, f"artifacts.{name}", artifact=name)


def _path(flight: dict[str, Any], file: str) -> Iterator[Finding]:
    segments = flight["segments"]
    for key in ("eye", "target"):
        for k, segment in enumerate(segments):
            after = segments[(k + 1) % len(segments)]
            for axis in range(3):
                a, b, c, d = segment[key][axis]
                size = 1.0 + abs(a) + abs(b) + abs(c) + abs(d)
                gaps = (a + b + c + d - after[key][axis][0], b + 2 * c + 3 * d - after[key][axis][1])
                if max(abs(gap) for gap in gaps) > _JUMP * size:
                    what = f"{key} jumps by {gaps[0]:.3g} m, its velocity by {gaps[1]:.3g} m a segment"
                    yield Finding("PZ403", file, what, f"flight.segments[{k}].{key}[{axis}]")
