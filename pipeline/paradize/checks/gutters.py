"""Tells maps whose mips end too early, and samples the published maps along the borders of every UV island,
at every level in use, straight on and at the largest parallax offset: no sample may read texels of another
island (uv_borders.py)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.checks.rules import Finding, isolated
from paradize.checks.uv_borders import WORST, Borders, compared_levels, find_borders, is_safe, parallax_shift
from paradize.data import Mesh, Texture
from paradize.documents import SCENE_FILE
from paradize.errors import ParadizeError
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.layout import MAX_SIZE
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.scene.manifest import map_sets, read_entry, repeats
from paradize.map_table import MAPS

F32 = npt.NDArray[np.float32]
_DIGITS = 1e-5  # scene.json holds six
_GUESSED = 1.1  # of the bound, up to which levels below placeholders are safe: the bake knew the finest


def check_gutters(manifest: dict[str, Any], folder: Path) -> Iterator[Finding]:
    """The findings in the objects of a manifest, whose files lie in `folder`. Another rule reports files that
    cannot be read."""
    for name, artifact in manifest["artifacts"].items():
        yield from _early_end(name, artifact, folder)
    for item in manifest["objects"]:
        yield from isolated(_object(manifest, folder, item), str(folder / SCENE_FILE))


def _early_end(name: str, artifact: dict[str, Any], folder: Path) -> Iterator[Finding]:
    gutter, last = artifact["gutter"], artifact["max_level"]
    if not gutter or last is None or last >= gutter["level_in_use"]:
        return
    used = gutter["level_in_use"]
    needed = max(
        gutter["bleed_p99"][: used + 1] + [worst / WORST for worst in gutter["bleed_max"][: used + 1]]
    )
    what = (
        f"level {last} is the last that is sampled, but the flight would use level {used}; the object's "
        f"bleed of {gutter['bound']:g} would have to be {math.ceil(1000.0 * needed) / 1000.0:g}"
    )
    yield Finding("PZ223", str(folder / artifact["file"]), what, name)


def _object(manifest: dict[str, Any], folder: Path, item: dict[str, Any]) -> Iterator[Finding]:
    for material, materials in map_sets(item):
        names = {key: name for key, name in material["maps"].items() if name is not None}
        names = {key: name for key, name in names.items() if manifest["artifacts"][name]["gutter"]}
        if not names:
            continue
        try:
            mesh = decode_glb(_read(manifest, folder, item["mesh"]))[0].mesh
        except ParadizeError:
            return
        reaches = {name: _reach(item["materials"][name]) for name in materials}
        part = mesh.of_materials(materials)
        moved = _left_out(manifest["artifacts"][item["mesh"]]) > 0
        yield from _layout(manifest, folder, part, names, reaches, repeats(material), moved)


def _layout(
    manifest: dict[str, Any],
    folder: Path,
    mesh: Mesh,
    names: dict[str, str],
    reaches: dict[str, float],
    repeat: bool,
    moved: bool,
) -> Iterator[Finding]:
    """The findings in the maps of one UV layout. mesh: the triangles that have it. names: its textures, by
    map. moved: the mesh is a level of detail whose islands end elsewhere than those that the maps were made
    for, so beside them the maps hold texels of their own islands."""
    borders: dict[tuple[int, int], Borders | None] = {}
    for key, name in names.items():
        artifact = manifest["artifacts"][name]
        try:
            texture = decode_ktx2(_read(manifest, folder, name))
            left = _left_out(artifact)
            width, height = texture.width << left, texture.height << left
            if max(width, height) > MAX_SIZE:
                what = f"{left} finer levels than {texture.width} x {texture.height} texels are none"
                place = f"artifacts.{name}.required_detail.left_out"
                yield Finding("PZ102", str(folder / SCENE_FILE), what, place)
                continue
            if mesh.uvs is not None and (width, height) not in borders:
                found = find_borders(mesh, width=width, height=height, repeat=repeat)
                borders[width, height] = found.with_gutters_as_they_are() if found and moved else found
        except ParadizeError:
            continue
        at = borders.get((width, height))
        if at is not None:
            yield from _walk(
                at, texture, key=key, name=name, reaches=reaches, artifact=artifact, folder=folder
            )


def _read(manifest: dict[str, Any], folder: Path, name: str) -> bytes:
    try:
        return read_entry(folder, manifest["artifacts"][name])
    except OSError:
        return b""


def _left_out(artifact: dict[str, Any]) -> int:
    """The number of finer levels that the bake made and did not publish."""
    return int(artifact["required_detail"]["left_out"]) if artifact["required_detail"] else 0


def _padded(levels: list[F32], left: int) -> list[F32]:
    """The levels below `left` finer ones, which are only placeholders of the right size: each texel holds
    the mean of those that were there."""
    finer = [np.ascontiguousarray(levels[0].repeat(1 << k, 0).repeat(1 << k, 1)) for k in range(left, 0, -1)]
    return finer + levels


def _measured(artifact: dict[str, Any], name: str, count: int, folder: Path) -> Iterator[Finding]:
    """Judges the bake's own measure of a map whose finest levels were left out: its gutters repeat texels of
    a level that is gone, which the walk cannot compare."""
    gutter = artifact["gutter"]
    levels = zip(gutter["bleed_p99"][:count], gutter["bleed_max"][:count], strict=False)
    for level, (p99, worst) in enumerate(levels):
        if not max(p99, worst / WORST) <= gutter["bound"] * (1.0 + _DIGITS):
            what = (
                f"beside an island samples were off by up to {worst:.3g} of the range, one in a hundred by "
                f"{p99:.3g} or more, when it was baked; {gutter['bound']:g} is accepted"
            )
            yield Finding("PZ221", str(folder / artifact["file"]), what, f"{name} level {level}")


def _filled(excess: F32, bound: float, name: str, file: str) -> Iterator[Finding]:
    """Finds a gutter that was filled with something else than its island. excess: Borders.gutter_excess."""
    y, x = np.unravel_index(int(excess.argmax()), excess.shape)
    if excess[y, x] > WORST * bound:
        what = (
            f"beside an island the gutter is {excess[y, x]:.3g} of the range beyond what the island's texels "
            f"allow; {WORST * bound:g} is accepted"
        )
        yield Finding("PZ221", file, what, f"{name} level 0 texel ({x}, {y})")


def _reach(material: dict[str, Any]) -> float:
    """How far parallax moves samples: as the scene sets it, at most the limit."""
    if material["maps"]["height"] is None:
        return 0.0
    reach = parallax_shift(material["parallax_scale"], material["parallax_bias"])
    limit = material["parallax_limit"]
    return reach if limit is None else min(reach, limit)


def _walk(
    borders: Borders,
    texture: Texture,
    key: str,
    name: str,
    reaches: Mapping[str, float],
    artifact: dict[str, Any],
    folder: Path,
) -> Iterator[Finding]:
    accepted = bound = artifact["gutter"]["bound"]
    baked = [artifact["gutter"][f"bleed_{key}"][0] * (1.0 + _DIGITS) for key in ("p99", "max")]
    left = _left_out(artifact)
    count = len(texture.levels) if artifact["max_level"] is None else artifact["max_level"] + 1
    if left:
        yield from _measured(artifact, name, count, folder)
    known = [*[(1.0, 1.0)] * left, (baked[0], baked[1]), *[(0.0, 0.0)] * len(texture.levels)]  # by level
    shown = compared_levels(texture, key)[:count]
    if left:
        yield from _filled(
            borders.gutter_excess(shown[0], left), accepted, name, str(folder / artifact["file"])
        )
        borders, bound = borders.with_gutters_as_they_are(), _GUESSED * accepted  # other islands alone
    levels = _padded(shown, left)
    far = borders.reach(reaches)
    steep = borders.walked(levels, MAPS[key].kind, far)
    flat = steep
    bad = any(not is_safe(found, bound, at) for found, at in zip(steep, known, strict=False))
    if bad and (far > 0.0).any():
        flat = borders.walked(levels, MAPS[key].kind, far.clip(max=0.0))
    for level, (here, moved) in enumerate(zip(flat, steep, strict=True)):
        if level < left:
            continue
        worse = here if not is_safe(here, bound, known[level]) else moved
        if is_safe(worse, bound, known[level]):
            continue
        # A wrong sample on the island's own side is the fault of the gutter, also under parallax.
        code = "PZ222" if worse is moved and moved is not here and moved.own < 0.5 else "PZ221"
        what = (
            f"beside an island samples are off by up to {worse.worst:.3g} of the range, one in a hundred by "
            f"{worse.all_p99:.3g} or more; {accepted:g} is accepted"
        )
        place = f"{name} level {level - left} texel ({worse.x >> level}, {worse.y >> level})"
        yield Finding(code, str(folder / artifact["file"]), what, place)
