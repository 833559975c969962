"""Levels of detail beside every simplifier at hand, at equal counts, all judged by metrics/surface.py.

A dense, detailed, closed surface with texture seams, 870k triangles to 100k, and these to 10k. Peers that
keep attributes and seams: meshoptimizer's simplifyWithAttributes (0.22, inside PyPI's package) and
simplifyWithUpdate (npm's, whose times are those of its WASM build), pymeshlab's quadric edge collapse with
texture. Those that know positions alone stand beside them as the limit: meshoptimizer, pymeshlab,
fast-simplification, pyfqmr. A peer's result starts its own next level, as ours does.
"""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
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
from paradize.metrics.mapped_normal import normal_error, uv_shift
from paradize.metrics.surface import Original
from paradize.stages.lod.meshoptimizer import meshopt_simplify
from row import BASELINE, Row, Trade, on
from tests.places import ROOT

TARGETS = (100_000, 10_000)
SAMPLES = 200_000
SHADED = 50_000  # samples of normals and textures
NODE_MODULES = ROOT / "build/node/node_modules"
# Of a turned unit normal and of a texture that slides by its own size: ours as tier balanced sets them; those
# that meshoptimizer errs least with among 0.5, 0.2 and 0.02.
_NORMAL, _UV = 0.001, 0.05
_MESHOPT = 0.02

Points: TypeAlias = npt.NDArray[np.float64]
Faces: TypeAlias = npt.NDArray[np.uint32]
# (seconds, positions, triangles, texture coordinates and normals (n, 5) where they are kept) of each level
Levels: TypeAlias = list[tuple[float, Points, Faces, npt.NDArray[np.float32] | None]]


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


def bare(mesh: Mesh) -> Levels:
    """Ours of positions alone, as the libraries that know no more."""
    places, first = number_rows(mesh.positions)
    points, faces = mesh.positions[first].astype(np.float64), places[mesh.triangles]
    levels: Levels = []
    for target in TARGETS:
        start = time.process_time()
        found = simplify(points, faces, target=target)
        points, faces = found.positions, found.triangles
        levels.append((time.process_time() - start, points, faces, None))
    return levels


def ours(mesh: Mesh) -> Levels:
    weights = [_UV] * 2 + [_NORMAL] * 3
    levels: Levels = []
    start = time.process_time()
    points, faces, columns = mesh.positions.astype(np.float64), mesh.triangles, _columns(mesh)
    places = number_rows(mesh.positions)[0]
    for target in TARGETS:
        found = simplify(
            points, faces, target=target, attributes=columns, weights=weights, unit=2, seams=places
        )
        seconds = time.process_time() - start
        points, faces, columns, places = found.positions, found.triangles, found.attributes, found.place
        levels.append((seconds, points, faces, columns))
        start = time.process_time()
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
        start = time.process_time()
        faces = meshopt_simplify(points, faces, columns, weights, locked, target)
        levels.append((time.process_time() - start, points, faces, columns if attributes else None))
    return levels


def meshopt_update(mesh: Mesh, folder: Path, *, attributes: bool) -> Levels:
    """simplifyWithUpdate of npm's meshoptimizer, in node; reading, writing and its start are left out."""
    points, faces, columns = mesh.positions, mesh.triangles, _columns(mesh)
    weights = [_MESHOPT] * 5
    if not attributes:
        places, first = number_rows(mesh.positions)
        points, faces = points[first], places[faces]
        columns, weights = np.zeros((len(points), 1), np.float32), [0.0]
    file = folder / "surface.bin"
    file.write_bytes(points.tobytes() + columns.tobytes() + np.ascontiguousarray(faces, np.uint32).tobytes())
    output = subprocess.run(
        ["node", Path(__file__).parents[1] / "meshoptimizer.mjs", file, str(len(points)),
         ",".join(map(str, weights)), *map(str, TARGETS)],
        capture_output=True, text=True, check=True,
        env={**os.environ, "PARADIZE_NODE_MODULES": str(NODE_MODULES)},
    ).stdout  # fmt: skip
    levels: Levels = []
    for which, milliseconds in enumerate(json.loads(output)):
        data, split = Path(f"{file}.{which}").read_bytes(), [points.nbytes, points.nbytes + columns.nbytes]
        found = np.frombuffer(data[: split[0]], np.float32).reshape(points.shape).astype(np.float64)
        kept = np.frombuffer(data[split[0] : split[1]], np.float32).reshape(columns.shape)
        triangles = np.frombuffer(data[split[1] :], np.uint32).reshape(-1, 3)
        levels.append((milliseconds / 1e3, found, triangles, kept if attributes else None))
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
        start = time.process_time()
        collapse(targetfacenum=target, preservenormal=True)
        seconds = time.process_time() - start
        found = meshes.current_mesh()
        levels.append((seconds, found.vertex_matrix(), found.face_matrix().astype(np.uint32), None))
    return levels


def positions_only(mesh: Mesh, collapse: Callable[[Points, Faces, int], tuple[Points, Faces]]) -> Levels:
    places, first = number_rows(mesh.positions)
    points, faces = mesh.positions[first].astype(np.float64), places[mesh.triangles]
    levels: Levels = []
    for target in TARGETS:
        start = time.process_time()
        points, faces = collapse(points, faces, target)
        levels.append((time.process_time() - start, points, faces, None))
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


def _error(judge: Original, levels: Levels, which: int) -> tuple[float, str]:
    """The RMS, and what is told."""
    _, points, faces, columns = levels[which]
    level = Mesh(np.ascontiguousarray(points, np.float32), np.ascontiguousarray(faces, np.uint32))
    found = Original(judge.mesh).distance(level, SAMPLES)
    rms, most = found["error_rms"], found["error_max"]
    text = f"{len(faces)} triangles, rms {rms:.3e}, max {most:.2e} of the diagonal"
    if columns is None:
        return rms, text
    length = np.maximum(np.linalg.norm(columns[:, 2:], axis=1, keepdims=True), 1e-20)
    level = replace(level, uvs=columns[:, :2].copy(), normals=(columns[:, 2:] / length).astype(np.float32))
    turned = normal_error(judge, level, SHADED, apart=most)["normal_p99_deg"]
    slid = uv_shift(judge, level, SHADED)["uv_shift_p99"]
    return rms, f"{text}; 99 % of normals within {turned:.1f} degrees, of textures within {slid:.1e}"


def _beside(name: str, ours: float, theirs: float) -> str:
    """Our RMS as a share of a peer's; of those that keep attributes and seams none may be nearer."""
    promised = "" if name.startswith("positions only") else ", promised: at most 1"
    kept = "" if not promised or ours <= theirs else ", NOT KEPT"
    return f"; rms {ours / theirs:.2f} of the peer's{promised}{kept}"


def _trade(name: str, rms: float, their_rms: float) -> Trade:
    less = name.startswith("positions only: ")
    short = name.removeprefix("positions only: ").removeprefix("npm ")
    short = short.replace(" (WASM, time inside node), simplifyWithUpdate", " 1.3, WASM")
    short = {"meshoptimizer, attributes": "meshoptimizer 0.22", "meshoptimizer": "meshoptimizer 0.22"}.get(
        short, short.removesuffix(", texture")
    )
    name = f"{short}{' ' if less else ''}"  # the same library may stand there twice
    panel = "Levels of detail: 868,332 to 100,000 triangles, RMS distance"
    return Trade(panel, "balanced", name, rms, their_rms, less)


def rows(runs: int, folder: Path) -> Iterator[Row]:
    mesh = centred()
    judge = Original(mesh)
    updating = "npm meshoptimizer (WASM, time inside node), simplifyWithUpdate"
    peers: list[tuple[str, bool, Callable[[Mesh], Levels]]] = [
        ("meshoptimizer, attributes", True, partial(meshopt, attributes=True)),
        (updating, True, partial(meshopt_update, folder=folder, attributes=True)),
        ("pymeshlab, texture", False, partial(meshlab, folder=folder, texture=True)),
        ("positions only: meshoptimizer", True, partial(meshopt, attributes=False)),
        (f"positions only: {updating}", True, partial(meshopt_update, folder=folder, attributes=False)),
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
        rms, error = _error(judge, mine[0], which)
        for name, found in theirs.items():
            beside = float(np.median([levels[which][0] for levels in found]))
            their_rms, their_error = _error(judge, found[0], which)
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
                peer_on=on(1, "WASM" if "WASM" in name else BASELINE),
                trade=_trade(name, rms, their_rms) if which == 0 else None,
            )
    yield from _bare_rows(mesh, judge, min(runs, 5))


def _bare_rows(mesh: Mesh, judge: Original, runs: int) -> Iterator[Row]:
    pairs = [(bare(mesh), positions_only(mesh, _fast)) for _ in range(runs)]
    for which, target in enumerate(TARGETS):
        seconds = [float(np.median([pair[side][which][0] for pair in pairs])) for side in (0, 1)]
        (rms, error), (their_rms, their_error) = (_error(judge, side, which) for side in pairs[0])
        yield Row(
            f"LOD to {target} triangles, positions alone on both sides",
            seconds[0] * 1e3,
            "fast-simplification",
            seconds[1] * 1e3,
            f"{error}; rms {rms / their_rms:.2f} of the peer's",
            their_error,
            inside="arrays in memory to arrays in memory, one vertex a place",
            ours_on=on(1, BASELINE),
            peer_on=on(1, BASELINE),
        )
