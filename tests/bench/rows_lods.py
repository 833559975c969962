"""Levels of detail beside every simplifier at hand, at equal counts, all judged by metrics/surface.py.

A dense, detailed, closed surface with texture seams, 870k triangles to 100k, and these to 10k. Peers that
keep attributes and seams: meshoptimizer's simplifyWithAttributes, pymeshlab's quadric edge collapse with
texture. Those that know positions alone stand beside them as the limit: meshoptimizer, pymeshlab,
fast-simplification, pyfqmr. A peer's result starts its own next level, as ours does.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeAlias

import fast_simplification
import numpy as np
import numpy.typing as npt
import pyfqmr
import pymeshlab
from PIL import Image

from meshes import sphere, write_obj
from paradize.data import Mesh
from paradize.kernels.mesh import number_rows
from paradize.kernels.simplify import simplify
from paradize.metrics.surface import surface_distance
from paradize.stages.simplifiers import meshopt_simplify
from row import BASELINE, Row, on

TARGETS = (100_000, 10_000)
SAMPLES = 200_000
# Of a turned unit normal and of a texture that slides by its own size: ours as tier balanced sets them; those
# that meshoptimizer errs least with among 0.5, 0.2 and 0.02.
_NORMAL, _UV = 0.001, 0.05
_MESHOPT = 0.02

Points: TypeAlias = npt.NDArray[np.float64]
Faces: TypeAlias = npt.NDArray[np.uint32]
# (seconds, positions, triangles) of each level
Levels: TypeAlias = list[tuple[float, Points, Faces]]


def centred() -> Mesh:
    """The surface, moved to the origin and scaled to a diagonal of 1."""
    mesh = sphere()
    wide = mesh.positions.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    points = (wide - (low + high) / 2) / np.linalg.norm(high - low)
    return Mesh(points.astype(np.float32), mesh.triangles, normals=mesh.normals, uvs=mesh.uvs)


def _columns(mesh: Mesh) -> npt.NDArray[np.float32]:
    assert mesh.uvs is not None and mesh.normals is not None
    return np.ascontiguousarray(np.concatenate([mesh.uvs, mesh.normals], axis=1))


def ours(mesh: Mesh) -> Levels:
    weights = [_UV] * 2 + [_NORMAL] * 3
    levels: Levels = []
    start = time.perf_counter()
    points, faces, columns = mesh.positions.astype(np.float64), mesh.triangles, _columns(mesh)
    places = number_rows(mesh.positions)[0]
    for target in TARGETS:
        found = simplify(
            points, faces, target=target, attributes=columns, weights=weights, unit=2, seams=places
        )
        seconds = time.perf_counter() - start
        points, faces, columns, places = found.positions, found.triangles, found.attributes, found.place
        levels.append((seconds, points, faces))
        start = time.perf_counter()
    return levels


def meshopt(mesh: Mesh, *, attributes: bool) -> Levels:
    points, faces = mesh.positions.astype(np.float64), mesh.triangles
    columns, weights = np.zeros((len(points), 1), np.float32), np.zeros(1, np.float32)
    if attributes:
        columns, weights = _columns(mesh), np.full(5, _MESHOPT, np.float32)
    else:
        places, first = number_rows(mesh.positions)
        points, faces, columns = points[first], places[faces], columns[first]
    locked = np.zeros(len(points), np.uint8)
    levels: Levels = []
    for target in TARGETS:
        start = time.perf_counter()
        faces = meshopt_simplify(points, faces, columns, weights, locked, target)
        levels.append((time.perf_counter() - start, points, faces))
    return levels


def meshlab(mesh: Mesh, folder: Path, *, texture: bool) -> Levels:
    file = folder / "surface.obj"
    write_obj(mesh, file)
    file.write_text("mtllib surface.mtl\nusemtl stone\n" + file.read_text(encoding="ascii"), encoding="ascii")
    (folder / "surface.mtl").write_text("newmtl stone\nmap_Kd stone.png\n", encoding="ascii")
    Image.new("RGB", (4, 4)).save(folder / "stone.png")
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(file))
    collapse = (
        meshes.meshing_decimation_quadric_edge_collapse_with_texture
        if texture
        else meshes.meshing_decimation_quadric_edge_collapse
    )
    levels: Levels = []
    for target in TARGETS:
        start = time.perf_counter()
        collapse(targetfacenum=target, preservenormal=True)
        seconds = time.perf_counter() - start
        found = meshes.current_mesh()
        levels.append((seconds, found.vertex_matrix(), found.face_matrix().astype(np.uint32)))
    return levels


def positions_only(mesh: Mesh, collapse: Callable[[Points, Faces, int], tuple[Points, Faces]]) -> Levels:
    places, first = number_rows(mesh.positions)
    points, faces = mesh.positions[first].astype(np.float64), places[mesh.triangles]
    levels: Levels = []
    for target in TARGETS:
        start = time.perf_counter()
        points, faces = collapse(points, faces, target)
        levels.append((time.perf_counter() - start, points, faces))
    return levels


def _fast(points: Points, faces: Faces, target: int) -> tuple[Points, Faces]:
    found, kept = fast_simplification.simplify(
        3.5 * points, faces.astype(np.int32), target_count=target, agg=3
    )
    return found / 3.5, kept.astype(np.uint32)


def _fqmr(points: Points, faces: Faces, target: int) -> tuple[Points, Faces]:
    work = pyfqmr.Simplify()
    work.setMesh(points, faces.astype(np.int32))
    work.simplify_mesh(target_count=target, aggressiveness=3, preserve_border=True, verbose=False)
    found, kept, _ = work.getMesh()
    return np.asarray(found, np.float64), np.asarray(kept).astype(np.uint32)


def _error(mesh: Mesh, levels: Levels, which: int) -> tuple[float, str]:
    """The RMS, and what is told."""
    _, points, faces = levels[which]
    level = Mesh(np.ascontiguousarray(points, np.float32), np.ascontiguousarray(faces, np.uint32))
    found = surface_distance(mesh, level, SAMPLES)
    rms, most = found["error_rms"], found["error_max"]
    return rms, f"{len(faces)} triangles, rms {rms:.3e}, max {most:.2e} of the diagonal"


def _beside(name: str, ours: float, theirs: float) -> str:
    """Our RMS as a share of a peer's; of those that keep attributes and seams none may be nearer."""
    promised = "" if name.startswith("positions only") else ", promised: at most 1"
    kept = "" if not promised or ours <= theirs else ", NOT KEPT"
    return f"; rms {ours / theirs:.2f} of the peer's{promised}{kept}"


def rows(runs: int, folder: Path) -> Iterator[Row]:
    mesh = centred()
    peers: list[tuple[str, bool, Callable[[Mesh], Levels]]] = [
        ("meshoptimizer, attributes", True, partial(meshopt, attributes=True)),
        ("pymeshlab, texture", False, partial(meshlab, folder=folder, texture=True)),
        ("positions only: meshoptimizer", True, partial(meshopt, attributes=False)),
        ("positions only: fast-simplification", True, partial(positions_only, collapse=_fast)),
        ("positions only: pyfqmr", True, partial(positions_only, collapse=_fqmr)),
        ("positions only: pymeshlab", False, partial(meshlab, folder=folder, texture=False)),
    ]
    mine: list[Levels] = []
    theirs: dict[str, list[Levels]] = {}
    for name, quick, work in peers:
        # In turns, so that a busy moment meets both; the slow ones once.
        for _ in range(min(runs, 5) if quick else 1):
            mine.append(ours(mesh))
            theirs.setdefault(name, []).append(work(mesh))
    for which, target in enumerate(TARGETS):
        before = len(mesh.triangles) if which == 0 else TARGETS[which - 1]
        seconds = float(np.median([levels[which][0] for levels in mine]))
        rms, error = _error(mesh, mine[0], which)
        for name, found in theirs.items():
            beside = float(np.median([levels[which][0] for levels in found]))
            their_rms, their_error = _error(mesh, found[0], which)
            yield Row(
                f"LOD {before} -> {target} triangles, with uvs, normals and seams",
                seconds * 1e3,
                name,
                beside * 1e3,
                error + _beside(name, rms, their_rms),
                their_error,
                0.5 if name == "meshoptimizer, attributes" else None,
                inside="arrays in memory to arrays in memory; ours numbers vertices that share a place",
                ours_on=on(1, BASELINE),
                peer_on=on(1, BASELINE),
            )
