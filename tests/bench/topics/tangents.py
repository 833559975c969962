"""Tangent frames beside npm mikktspace, the reference compiled to WebAssembly; both on one thread."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

import meshes
from paradize.data import Mesh
from paradize.kernels.mesh import split_tangents
from paradize.kernels.reference import angles_deg, mikktspace_tangents
from row import Row, median_ms, on
from tests.places import ROOT

PROMISE = 25.0
NODE_MODULES = ROOT / "build/node/node_modules"

Corners = npt.NDArray[np.float32]


def npm(mesh: Mesh, runs: int, folder: Path) -> tuple[float, Corners]:
    """Median milliseconds inside node, start-up and reading left out, after a call that is not counted; and
    its tangents (m, 3, 4), the sign turned."""
    path = folder / "surface.bin"
    corner = mesh.triangles.reshape(-1)
    assert mesh.normals is not None and mesh.uvs is not None
    path.write_bytes(b"".join(rows[corner].tobytes() for rows in (mesh.positions, mesh.normals, mesh.uvs)))
    command = ["node", str(ROOT / "tests/e2e/mikktspace.mjs"), str(runs + 1), str(path)]
    environment = {**os.environ, "PARADIZE_NODE_MODULES": str(NODE_MODULES)}
    output = subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout
    found = np.fromfile(f"{path}.out", np.float32).reshape(-1, 3, 4) * np.array([1, 1, 1, -1], np.float32)
    return statistics.median(json.loads(output)[str(path)][1:]), found


def against(found: Corners, truth: Corners) -> tuple[str, str]:
    angles = angles_deg(found[..., :3].reshape(-1, 3), truth[..., :3].reshape(-1, 3))
    over = float((angles > 1).mean()) * 100
    signs = float((found[..., 3] != truth[..., 3]).mean()) * 100
    return f"max {angles.max():.1e} degrees", f"{over:.4f} % over 1 degree, {signs:.4f} % of the signs"


def bench(name: str, mesh: Mesh, runs: int, folder: Path) -> Iterator[Row]:
    surface = (mesh.positions, mesh.normals, mesh.uvs, mesh.triangles)
    assert mesh.normals is not None and mesh.uvs is not None
    theirs_ms, theirs = npm(mesh, max(1, runs // 3), folder)
    truth = mikktspace_tangents(*surface)
    index, _, tangents = split_tangents(*surface, threads=1)
    ours = tangents[index]
    size, shares = against(ours, theirs)
    message = f"{shares}, {size} from npm's; {against(ours, truth)[0]} from float64"
    peer_error = f"{against(theirs, truth)[0]} from float64"
    peer = "npm mikktspace (WASM), time inside node"
    ours_ms = median_ms(partial(split_tangents, *surface, threads=1), runs)
    title = (
        f"tangents of vertices, split where they differ, {name}, {len(mesh.triangles)} triangles, one thread"
    )
    yield Row(
        title, ours_ms, peer, theirs_ms, message, peer_error, PROMISE,
        inside="arrays in memory to the frame of every corner; ours makes an indexed mesh of them too",
        ours_on=on(1), peer_on=on(1, "WASM"),
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    if not NODE_MODULES.is_dir():
        raise SystemExit("no build/node/node_modules: `make setup-test` brings npm mikktspace")
    yield from bench("sphere of six charts", meshes.sphere(), runs, folder)
    yield from bench("torus, its image mirrored", meshes.torus(mirrored=True), runs, folder)
