"""Finds the finest level of every texture and mesh that a scene's views need, from the baked meshes and the
flight. Runs in a worker.

Constants repeat what the shaders do; tests/pipeline/visibility/test_required_detail.py compares them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from paradize.build.artifacts import read_artifact
from paradize.data import Mesh, rounded
from paradize.formats.glb.reader import decode_glb
from paradize.formats.glb.tiles import decode_tile
from paradize.visibility.finest_mip import (
    FinestMip,
    Placement,
    Surface,
    finest,
    finest_lod,
    flat_triangles,
    surface_of,
)
from paradize.visibility.first_seconds import Seconds, mip_seconds, texels_by_run
from paradize.visibility.texel_footprint import Views, views_of

Size = tuple[int, int]  # width, height in texels
# Widths of the layers of waves over the first one's, inverted (player/passes/environment_bindings.cpp).
WAVES = {"normal": 0.137, "dudv": 1.0}
# The sand (shaders/terrain.frag). Gradients are shortened to SHORTEST at least. Beyond REFERENCE_REPEATS
# repeats it is sampled at scales that keep grains as wide as at GRAINS of that distance. Lumps are the same
# normals, wider, near the camera.
SHORTEST, REFERENCE_REPEATS, GRAINS, LUMPS = 0.35, 4.0, 0.35, 0.19 * 0.74
SEA_MIP = 2  # of the sky that water shows without [reflection] (shaders/water.frag)


@dataclass(frozen=True)
class SeenTexture:
    """A texture of an object. materials: those of the object that it lies on. spread: share of its side by
    which parallax may move two neighbouring samples apart. lit: whether shadows read it. second: whether it
    lies on second texture coordinates."""

    size: Size
    materials: tuple[str, ...]
    spread: float = 0.0
    lit: bool = False
    second: bool = False


@dataclass(frozen=True)
class SeenObject:
    """An object. glb: its levels. textures: SeenTexture's fields by artifact. drawn: the views that draw it.
    errors_m, center, radius_m: as in scene.json, of the whole chain."""

    glb: bytes
    textures: Mapping[str, Mapping[str, Any]]
    drawn: tuple[str, ...]
    instances: Sequence[Mapping[str, Any]]
    center: tuple[float, float, float]
    radius_m: float
    errors_m: Sequence[float]


def measure_required_detail(
    flight_views: dict[str, Any],
    objects: Mapping[str, dict[str, Any]],
    terrain: dict[str, Any] | None,
    water: dict[str, Any] | None,
    sky: dict[str, Any] | None,
) -> dict[str, dict[str, Any]]:
    """Returns by artifact {"level", "texels", "second_s", "view", "levels_s"}: the finest level that is ever
    needed; for textures the least number of level 0's texels that a pixel covers (None: never seen); when,
    and by which view; of each level the second of the flight from which on it or a finer one is needed (None:
    never). For a texture whose flat triangles (finest_mip.flat_triangles) need a finer level than all others
    it also returns {"others": the same without them}; flat_colors.py then decides.

    flight_views: see texel_footprint.views_of, and `light_m`. objects: SeenObject's fields by object name.
    terrain: `textures` (size by name), `tiles` (bytes or files), `repeat_m`. water: `textures`, `level_m`,
    `size_m`, `repeat`. sky: `side` (texels), `levels`, `smoothest` (the largest smoothness that mirrors it).
    """
    light_m = flight_views["light_m"]
    detail: dict[str, dict[str, Any]] = {}
    for name, fields in objects.items():
        detail |= _object_detail(name, SeenObject(**fields), flight_views, light_m)
    everywhere = views_of(flight_views, ("camera", "reflection", "refraction"), None)
    if terrain:
        detail |= _terrain_detail(everywhere, **terrain)
    if water:
        detail |= _water_detail(views_of(flight_views, ("camera",), None), **water)
    if sky:
        detail["sky"] = _sky_detail(everywhere, water=water is not None, **sky)
    return detail


def _levels_of(size: Size) -> int:
    """The mips of a texture."""
    return max(size).bit_length()


def _detail_json(finest_mip: FinestMip, levels_s: Seconds) -> dict[str, Any]:
    texels = rounded(finest_mip.texels) if finest_mip.texels < float("inf") else None
    return {
        "level": finest_mip.level(),
        "texels": texels,
        "second_s": finest_mip.second_s,
        "view": finest_mip.view,
        "levels_s": levels_s,
    }


def _object_detail(
    name: str, seen_object: SeenObject, flight_views: dict[str, Any], light_m: float | None
) -> dict[str, dict[str, Any]]:
    levels = [lod.mesh for lod in decode_glb(seen_object.glb, name)]
    views = views_of(flight_views, seen_object.drawn, light_m)
    places = [Placement(instance) for instance in seen_object.instances]
    level, second, view, levels_s = finest_lod(
        views, seen_object.center, seen_object.radius_m, seen_object.errors_m, places
    )
    mesh: dict[str, Any] = {"level": level, "texels": None, "second_s": second, "view": view}
    mesh["levels_s"] = levels_s
    detail = {f"{name}_mesh": mesh}
    known: dict[SeenTexture, dict[str, Any]] = {}
    for key, fields in seen_object.textures.items():
        texture = SeenTexture(**fields)
        if texture not in known:
            seen = views if texture.lit else views_of(flight_views, seen_object.drawn, None)
            own = [mesh.of_materials(texture.materials) for mesh in levels]
            own = [replace(mesh, uvs=mesh.uvs1) for mesh in own] if texture.second else own
            known[texture] = _texture_detail(seen_object, texture, own, places, seen)
        detail[key] = known[texture]
    return detail


def _texture_detail(
    seen_object: SeenObject,
    texture: SeenTexture,
    levels: Sequence[Mesh],
    places: Sequence[Placement],
    views: Views,
) -> dict[str, Any]:
    """Returns the required detail of an object's texture, as measure_required_detail does. levels: the
    triangles that it lies on."""
    size, spread = texture.size, texture.spread

    def detail_of(*, flat: bool) -> dict[str, Any]:
        by_level = {
            k: surface_of(mesh, mesh.uvs, *size, flat=flat)
            for k, mesh in enumerate(levels)
            if mesh.uvs is not None
        }
        surfaces = [
            (surface, Placement(at.instance, _from_m(seen_object, k, at.scale, views)))
            for k, surface in by_level.items()
            for at in places
        ]
        texels = texels_by_run(views, _joined(by_level.values()), places, spread * max(size))
        seconds = mip_seconds(views.query, texels, _levels_of(size))
        return _detail_json(finest(views, surfaces, spread * max(size)), seconds)

    whole = detail_of(flat=True)
    flat = (mesh.uvs is not None and flat_triangles(mesh, mesh.uvs, *size).any() for mesh in levels)
    if spread > 0.0 or texture.second or not any(flat):  # parallax shows more than the line
        return whole
    others = detail_of(flat=False)
    return whole | {"others": others} if others["level"] > whole["level"] else whole


def _joined(surfaces: Iterable[Surface]) -> Surface:
    parts = [Surface(np.zeros((0, 3, 3)), np.zeros(0)), *surfaces]
    return Surface(
        np.concatenate([part.corners for part in parts]), np.concatenate([part.density for part in parts])
    )


def _from_m(seen_object: SeenObject, level: int, scale: float, views: Views) -> float:
    """Returns the distance below which a level of detail is not drawn, metres."""
    return seen_object.errors_m[level] * scale * views.query.pixels * (1.0 - 1e-5) if level else 0.0


def _terrain_detail(
    views: Views, textures: Mapping[str, Size], tiles: Sequence[bytes | str], repeat_m: float
) -> dict[str, dict[str, Any]]:
    data = [tile if isinstance(tile, bytes) else read_artifact(Path(tile)) for tile in tiles]
    patches = [patch.mesh for tile in data for patch in decode_tile(tile)]
    detail = {}
    for name, size in textures.items():
        surfaces = []
        for mesh in patches:
            uvs = mesh.uvs if name.startswith("sand") else mesh.uvs1
            if uvs is not None:
                surfaces.append(surface_of(mesh, uvs, *size))
        least = _joined(surfaces)
        seen = finest(views, [(least, Placement())])
        by_run = texels_by_run(views, least, [Placement()])
        if name.startswith("sand") and seen.texels < float("inf"):
            far_m = GRAINS * REFERENCE_REPEATS * repeat_m
            far = far_m * views.pixel * views.query.corner * views.query.corner * float(least.density.min())
            texels = SHORTEST * min(seen.texels, far)
            texels = min(texels, LUMPS * seen.texels) if name == "sand_normal" else texels
            seen = FinestMip(texels, seen.second_s, seen.view)
            lumps = LUMPS * by_run if name == "sand_normal" else by_run
            by_run = np.where(by_run < np.inf, np.minimum(SHORTEST * np.minimum(by_run, far), lumps), np.inf)
        detail[name] = _detail_json(seen, mip_seconds(views.query, by_run, _levels_of(size)))
    return detail


def _water_detail(
    views: Views, textures: Mapping[str, Size], level_m: float, size_m: float, repeat: float
) -> dict[str, dict[str, Any]]:
    half = 0.5 * size_m
    corners = [(-half, level_m, -half), (half, level_m, -half), (-half, level_m, half), (half, level_m, half)]
    square = np.array([[corners[0], corners[2], corners[1]], [corners[1], corners[2], corners[3]]])
    detail = {}
    dry = bool((views.query.eye[1] - views.query.slack_m - views.query.reach[1] > level_m).all())
    for name, size in textures.items():
        density = WAVES[name.rpartition("_")[2]] * repeat / size_m * min(size)
        surface = Surface(square, np.full(2, density))
        seen = finest(views, [(surface, Placement())])
        by_run = texels_by_run(views, surface, [Placement()])
        # Under water the waves' light upon the floor may be nearer than the waves.
        if not dry:
            seen, by_run = FinestMip(0.0, None, "camera"), np.zeros(len(by_run))
        detail[name] = _detail_json(seen, mip_seconds(views.query, by_run, _levels_of(size)))
    return detail


def _sky_detail(
    views: Views, *, water: bool, side: int, levels: int, smoothest: float | None
) -> dict[str, Any]:
    """A face's texels are sparsest in its middle: side / 2 per radian."""
    corner = views.query.corner * views.query.corner
    texels = 0.5 * side * views.pixel * corner / max(1.0, views.mirror or 0.0)
    detail = _detail_json(FinestMip(texels, 0.0, "camera"), [])
    if water:
        detail["level"] = min(detail["level"], SEA_MIP)
    if smoothest is not None:
        blur = max(0.0, levels - 2.3)
        rough = float(np.sqrt(1.0 - smoothest))
        detail["level"] = min(detail["level"], int(blur * rough))
    detail["levels_s"] = [0.0 if level >= detail["level"] else None for level in range(levels)]
    return detail
