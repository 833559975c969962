"""Every kernel that takes a mesh, points or heights refuses, at its door, numbers that are not finite and
indices of vertices that are not there: native code trusts both."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from paradize.kernels import atlas, maps, mesh, obj, occlusion, openmesh, reference, simplify, terrain
from paradize.kernels.reference.atlas import layout_quality
from paradize.kernels.reference.seen import SeenMesh
from paradize.kernels.reference.terrain import terrain_error

Arrays = dict[str, np.ndarray]

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.25]], np.float32)
UPWARD = np.tile(np.array([[0, 0, 1]], np.float32), (4, 1))
UVS = np.ascontiguousarray(CORNERS[:, :2])
HALVES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
GROUND = np.add.outer(np.arange(5), np.arange(5)).astype(np.float32)
SURFACE = {"positions": CORNERS, "normals": UPWARD, "uvs": UVS, "triangles": HALVES}


def _shading(positions: Any, triangles: Any, normals: Any, tangents: Any, uvs: Any) -> object:
    return reference.Shading(reference.Surface(positions, triangles), normals, tangents, uvs)


def _angles(normal_map: Any) -> object:
    truth = reference.Shading(reference.Surface(CORNERS, HALVES), UPWARD, None, None)
    return truth.angles_to(truth, near=0.1, samples=10, normal_map=normal_map)


def _open_shares(points: Any, normals: Any, faces: Any) -> object:
    texels = np.zeros(len(points), np.uint32)
    return occlusion.Blockers(CORNERS, HALVES, 16).open_shares(points, normals, faces, texels, 4, reach=1.0)


# The call with its arrays, each sound: every float of them must be finite, every `triangles` below the count.
DOORS: dict[str, tuple[Callable[..., object], Arrays]] = {
    "atlas.make_charts": (
        lambda **given: atlas.make_charts(**given, deviation=0.5),
        {"positions": CORNERS, "triangles": HALVES},
    ),
    "atlas.pack": (
        lambda corners: atlas.pack(corners, [0], 1, resolution=64, padding=1),
        {"corners": UVS[HALVES[:1]]},
    ),
    "maps.uv_islands": (maps.uv_islands, {"uvs": UVS, "triangles": HALVES}),
    "maps.rasterise": (
        lambda **given: maps.rasterise(**given, ids=np.zeros(2, np.int32), height=8, width=8),
        {"uvs": UVS, "triangles": HALVES},
    ),
    "mesh.number_rows": (mesh.number_rows, {"rows": CORNERS}),
    "mesh.number_corners": (lambda rows: mesh.number_corners([0, 1, 2, 3], rows), {"rows": CORNERS}),
    "mesh.corner_normals": (
        lambda **given: mesh.corner_normals(**given, crease_deg=30.0),
        {"positions": CORNERS, "triangles": HALVES},
    ),
    "mesh.split_tangents": (mesh.split_tangents, SURFACE),
    "mesh.topology": (lambda triangles: mesh.topology(triangles, 4), {"triangles": HALVES}),
    "mesh.weld_points": (lambda points: mesh.weld_points(points, 0.1), {"points": CORNERS}),
    "mesh.project": (
        lambda **given: mesh.project(**given, charts=[0, 0]),
        {"source_positions": CORNERS, "source_triangles": HALVES, "positions": CORNERS, "triangles": HALVES},
    ),
    "mesh.reach": (lambda **given: mesh.reach(**given, rooted=0.1), {"places": CORNERS, "triangles": HALVES}),
    "obj.origin_of": (
        obj.origin_of,
        {"positions": CORNERS.astype(np.float64), "triangles": HALVES},
    ),
    "obj.cut_polygons": (
        lambda positions, corners: obj.cut_polygons(positions, corners, np.array([4], np.uint32)),
        {"positions": CORNERS.astype(np.float64), "corners": np.arange(4, dtype=np.uint32)},
    ),
    "occlusion.places": (
        lambda **given: occlusion.places(**given, touched=np.zeros((4, 4), np.int32)),
        {"uvs": UVS, "triangles": HALVES},
    ),
    "occlusion.Blockers": (
        lambda **given: occlusion.Blockers(**given, rays=16),
        {"positions": CORNERS, "triangles": HALVES},
    ),
    "occlusion.open_shares": (_open_shares, {"points": CORNERS, "normals": UPWARD, "faces": UPWARD}),
    "reference.Surface": (reference.Surface, {"positions": CORNERS, "triangles": HALVES}),
    "reference.Shading": (_shading, SURFACE | {"tangents": np.ones((4, 4), np.float32)}),
    "reference.angles_to": (_angles, {"normal_map": np.tile(UPWARD, (2, 1, 1))}),
    "reference.loading": (
        lambda **given: reference.loading(**given, origin=(0.0, 0.0, 0.0)),
        {"positions": CORNERS, "source_positions": CORNERS.astype(np.float64), "triangles": HALVES},
    ),
    "reference.angles_deg": (reference.angles_deg, {"a": UPWARD, "b": UPWARD}),
    "reference.layout_quality": (
        layout_quality,
        {"positions": CORNERS, "triangles": HALVES, "corners": UVS[HALVES]},
    ),
    "reference.mikktspace_tangents": (reference.mikktspace_tangents, SURFACE),
    "reference.SeenMesh": (SeenMesh, SURFACE | {"colors": np.ones((4, 4), np.float32)}),
    "reference.terrain_error": (
        lambda **given: terrain_error(**given, heights_m=GROUND, size_m=(1.0, 1.0)),
        {"positions": CORNERS, "triangles": HALVES},
    ),
    "simplify.simplify": (
        lambda **given: simplify.simplify(**given, target=1),
        {
            "positions": CORNERS,
            "triangles": HALVES,
            "attributes": UVS,
            "weights": np.ones(2),
        },
    ),
    "terrain.refine": (lambda heights: terrain.refine(heights, 0.1), {"heights": GROUND}),
    "terrain.bisect": (lambda heights: terrain.bisect(heights, 0.1), {"heights": GROUND}),
}
if openmesh.BUILT:
    DOORS["openmesh.count"] = (openmesh.count, {"positions": CORNERS, "triangles": HALVES})
    DOORS["openmesh.simplify"] = (
        lambda **given: openmesh.simplify(**given, target=1),
        {"positions": CORNERS, "triangles": HALVES},
    )


@pytest.mark.parametrize("name", DOORS)
def test_sound_arrays_are_taken(name: str) -> None:
    call, arrays = DOORS[name]
    call(**arrays)


@pytest.mark.parametrize(
    ("name", "argument"),
    [(name, argument) for name, (_, arrays) in DOORS.items() for argument in arrays],
)
def test_what_is_not_finite_or_not_there_is_refused(name: str, argument: str) -> None:
    call, arrays = DOORS[name]
    sound = arrays[argument]
    bad: list[Any] = [np.nan, np.inf, -np.inf] if sound.dtype.kind == "f" else [4, 2**32 - 1]
    for value in bad:
        for place in (0, -1):
            harmed = sound.copy()
            harmed.flat[place] = value
            with pytest.raises(ValueError):
                call(**arrays | {argument: harmed})


@pytest.mark.parametrize(
    ("name", "argument"),
    [(name, key) for name, (_, arrays) in DOORS.items() for key in arrays if arrays[key].dtype.kind == "u"],
)
def test_numbers_that_no_index_can_be_are_refused_not_rounded(name: str, argument: str) -> None:
    call, arrays = DOORS[name]
    for value in (0.5, np.nan, -1, 1 << 32):
        harmed = arrays[argument].astype(type(value))
        harmed.flat[0] = value
        with pytest.raises(ValueError):
            call(**arrays | {argument: harmed})
