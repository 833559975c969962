"""Ambient occlusion beside Embree (embreex), which casts the same number of rays from the same places.

One thread on both sides: embreex casts ray by ray in one. Its rays follow the cosine at random, and are made
before the time begins. Both are held to brute force over all triangles.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from paradize.data import Mesh
from paradize.kernels.occlusion import Blockers
from paradize.kernels.reference.occlusion import open_shares
from paradize.readers.model import read_model
from paradize.stages.normals import complete_normals
from paradize.stages.validate import validate_mesh
from row import Row, on, pair_ms
from tests.pipeline.shapes import grid
from tests.places import CORPUS

F32 = npt.NDArray[np.float32]
PLACES, RAYS, REACH, CHECKED = 4096, 256, 0.25, 512
LIFT = 1e-5


@dataclass(frozen=True)
class Places:
    """A mesh whose box has a diagonal of 1, and the middles of some of its triangles."""

    mesh: Mesh

    @cached_property
    def points(self) -> F32:
        wide = self.mesh.positions.astype(np.float64)
        wide -= (wide.min(axis=0) + wide.max(axis=0)) / 2
        return (wide / np.linalg.norm(np.ptp(wide, axis=0))).astype(np.float32)

    @cached_property
    def frames(self) -> tuple[F32, F32]:
        """Where rays begin, and the triangles' normals."""
        triangles = self.mesh.triangles
        at = self.points[triangles[np.linspace(0, len(triangles) - 1, PLACES).astype(int)]].astype(np.float64)
        normals = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return (at.mean(axis=1) + LIFT * normals).astype(np.float32), normals.astype(np.float32)


def random_rays(normals: F32) -> F32:
    """(places, RAYS, 3) directions that follow the cosine to the normals."""
    rng = np.random.default_rng(1)
    ball = rng.normal(size=(len(normals), RAYS, 3))
    ball /= np.linalg.norm(ball, axis=2, keepdims=True)
    ways = ball + normals[:, None]
    return (ways / np.linalg.norm(ways, axis=2, keepdims=True)).astype(np.float32)


def row_of(what: str, mesh: Mesh, runs: int) -> Row:
    places = Places(mesh)
    begin, normals = places.frames
    texels = np.arange(PLACES, dtype=np.uint32)
    blockers = Blockers(places.points, mesh.triangles, RAYS)
    scene = EmbreeScene()
    TriangleMesh(scene, places.points, mesh.triangles.astype(np.int32))
    origins, ways = np.repeat(begin, RAYS, axis=0), random_rays(normals).reshape(-1, 3)

    def ours() -> F32:
        return blockers.open_shares(begin, normals, normals, texels, 64, reach=REACH, threads=1)

    def peer() -> F32:
        reach = np.full(len(origins), REACH, np.float32)
        met = scene.run(origins, ways, dists=reach, query="OCCLUDED")
        return (met.reshape(PLACES, RAYS) < 0).mean(axis=1).astype(np.float32)

    ours_ms, peer_ms = pair_ms(ours, peer, runs, time.thread_time)
    some = np.linspace(0, PLACES - 1, CHECKED).astype(int)
    corners = places.points[mesh.triangles].astype(np.float64)
    wide = [rows[some].astype(np.float64) for rows in (begin, normals, normals)]
    truth = open_shares(*wide, corners, reach=REACH)

    def error_text(shares: F32) -> str:
        return f"{PLACES * RAYS / 1e6:.2f} million rays, mean error {np.abs(shares[some] - truth).mean():.4f}"

    return Row(
        what, ours_ms, "embreex", peer_ms, error_text(ours()), error_text(peer()),
        inside="casting, without making the trees; ours turns its directions to the normals too",
        ours_on=on(1), peer_on=on(1, "random directions"),
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    del folder
    waves = grid(200, height=0.3)
    yield row_of(f"Occlusion of {len(waves.triangles)} triangles of waves", waves, runs)
    for name in ("obj-large/spot.obj", "obj-large/pirate.obj"):
        file = CORPUS / name
        if file.is_file():
            mesh = complete_normals(validate_mesh(read_model(file).mesh, file)[0], crease_deg=45.0)[0]
            yield row_of(f"Occlusion of {file.stem}, {len(mesh.triangles)} triangles", mesh, runs)
