"""Rules over a baked scene: its manifest, its files, its budgets, its camera path."""

from __future__ import annotations

import errno
import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any

from paradize.build.provenance import OURS
from paradize.check.against import WORSE_BY, check_against, earlier_scene
from paradize.check.budgets import check_budget
from paradize.check.flights import check_flight
from paradize.check.gutters import check_gutters
from paradize.check.layouts import check_layouts
from paradize.check.maps import scene_maps
from paradize.check.meshes import check_mesh
from paradize.check.rules import Finding, isolated
from paradize.check.sounds import check_sound
from paradize.check.terrain import check_tiles
from paradize.check.textures import check_texture
from paradize.check.verdicts import judged
from paradize.errors import FormatError
from paradize.formats.glb.reader import decode_glb
from paradize.formats.glb.tiles import decode_tile
from paradize.formats.scene_manifest import read_entry, read_scene, references

_JUMP = 1e-6  # of the segment's own size: how far apart two segments may meet


@dataclass(frozen=True)
class CheckOptions:
    """How to look. against: the folder of an earlier bake; worse_by: the share by which an error may have
    grown since. today: the day by which waivers end."""

    against: Path | None = None
    worse_by: float = WORSE_BY
    today: date = field(default_factory=date.today)


def check_scene(path: Path, look: CheckOptions) -> Iterator[Finding]:
    """The findings in a scene.json and everything that it names, as the scene itself wants them judged."""
    file = str(path)
    try:
        manifest = read_scene(path)
    except OSError as error:
        yield Finding("PZ101", file, error.strerror or str(error), mend=_mend(error))
        return
    except FormatError as error:
        yield Finding("PZ102", file, error.what, error.place or "")
        return
    owners = {str(path.parent / entry["file"]): name for name, entry in manifest["artifacts"].items()}
    found = (
        finding if finding.artifact else replace(finding, artifact=owners.get(finding.file, ""))
        for finding in _findings(manifest, path, look)
    )
    yield from judged(found, manifest["check"], file, look.today)


def _findings(manifest: dict[str, Any], path: Path, look: CheckOptions) -> Iterator[Finding]:
    file = str(path)
    colors = _colors(manifest)
    tiles = manifest["terrain"]["tiles"] if manifest["terrain"] else []
    for name, artifact in manifest["artifacts"].items():
        decode = decode_tile if name in tiles else decode_glb
        found = _artifact(path.parent, name, artifact, colors.get(name), decode)
        yield from isolated(found, str(path.parent / artifact["file"]))
    searches = [check_budget(manifest, path.parent, file)]
    if look.against:
        earlier = earlier_scene(look.against, path.parent)
        searches.append(check_against(manifest, earlier, file, look.worse_by))
    searches += [
        check_layouts(manifest, path.parent),
        check_gutters(manifest, path.parent),
        scene_maps(manifest, path.parent),
        check_tiles(manifest, path.parent),
        _unused(path.parent, manifest, file),
        _path(manifest["flight"], file),
        check_flight(manifest, path.parent, file),
    ]
    for search in searches:
        yield from isolated(search, file)


def _mend(error: OSError) -> str:
    """What to do about a file that cannot be read, where that is more than its rule says."""
    return "move it away, then bake again" if error.errno == errno.EISDIR else ""


def _colors(manifest: dict[str, Any]) -> dict[str, bool]:
    """Which textures are colour, by what reads them."""
    return {
        name: place.endswith("color") for place, name, kinds in references(manifest) if kinds == ("texture",)
    }


def _artifact(
    folder: Path,
    name: str,
    artifact: dict[str, Any],
    color: bool | None,
    decode: Callable[[bytes, object], object],
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
        found = list(check_mesh(data, file))
        yield from found
        if not any(finding.severity == "error" for finding in found):
            try:
                decode(data, file)
            except FormatError as error:
                yield Finding("PZ102", file, error.what, error.place or "")
    elif artifact["kind"] in ("texture", "cubemap"):
        yield from check_texture(data, file, color=color, last=artifact["max_level"])
    else:
        yield from check_sound(data, file)


def _unused(folder: Path, manifest: dict[str, Any], file: str) -> Iterator[Finding]:
    named = {artifact["file"] for artifact in manifest["artifacts"].values()}
    for path in sorted(folder.iterdir()):
        if OURS.fullmatch(path.name) and path.name not in named:
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
