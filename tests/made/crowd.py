"""The baked island with many instances: palms all over it, stones all over its sand."""

from __future__ import annotations

import json
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

from paradize.data import Group, Lod, Mesh
from paradize.formats.glb.encode import encode_glb
from tests.places import ROOT
from tests.player.synthetic import identity, material

SIZE_M, HEIGHT_M, BASE_M = 200.0, 24.0, -16.0  # of the island's terrain
ERRORS = (0.0, 0.02, 0.06, 0.15)  # of the stone's levels, relative to its radius


def places(count: int, above_m: float, seed: int = 7) -> npt.NDArray[np.float64]:
    """(count, 3) metres: random places on the island's ground above a height."""
    picture = oiio.ImageBuf(str(ROOT / "raw_assets/terrain/height.png"))
    heights = picture.get_pixels(oiio.FLOAT)[..., 0] * HEIGHT_M + BASE_M
    random = np.random.default_rng(seed)
    rows, columns = np.nonzero(heights > above_m)
    taken = random.integers(0, len(rows), count)
    step_m = SIZE_M / (np.array(heights.shape) - 1)
    z = rows[taken] * step_m[0] - SIZE_M / 2 + random.uniform(-0.4, 0.4, count) * step_m[0]
    x = columns[taken] * step_m[1] - SIZE_M / 2 + random.uniform(-0.4, 0.4, count) * step_m[1]
    return np.stack([x, heights[rows[taken], columns[taken]], z], axis=1)


def placed(at: npt.NDArray[np.float64], smallest: float, largest: float) -> list[dict[str, Any]]:
    """Instances of scene.json at these places, turned and scaled at random."""
    random = np.random.default_rng(len(at))
    turns = random.uniform(0.0, np.pi, len(at))
    sizes = random.uniform(smallest, largest, len(at))
    return [
        {"position": list(map(float, p)), "rotation": [0.0, sin(t), 0.0, cos(t)], "scale": [float(s)] * 3}
        for p, t, s in zip(at, turns, sizes, strict=True)
    ]


def sphere(level: int) -> Mesh:
    """A stone: an octahedron divided `level` times, its points pushed onto a bumpy sphere of radius 1."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float64)
    corners = points[[[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]]
    for _ in range(level):
        a, b, c = corners.swapaxes(0, 1)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.concatenate(
            [np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    unique, triangles = np.unique(corners.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    normals = unique / np.linalg.norm(unique, axis=1, keepdims=True)
    bumps = 0.85 + 0.15 * np.sin(3 * normals).prod(axis=1, keepdims=True)
    faces = triangles.reshape(-1, 3).astype(np.uint32)
    positions = (normals * bumps).astype(np.float32)
    groups = (Group("stone", "stone", 0, len(faces)),)
    return Mesh(positions, faces, normals.astype(np.float32), None, None, groups=groups)


def write_crowd(island: Path, folder: Path, palms: int = 0, stones: int = 0, *, alone: bool = False) -> Path:
    """Writes a scene folder: the island without its own palm, with so many palms and stones. alone: without
    its other objects too; its ground, sea, sky, lamps and particles stay."""
    scene = json.loads((island / "scene.json").read_text())
    folder.mkdir(parents=True)
    for artifact in scene["artifacts"].values():
        (folder / artifact["file"]).symlink_to((island / artifact["file"]).resolve())
    palm = next(entry for entry in scene["objects"] if entry["name"] == "palm")
    if alone:
        scene["objects"] = [palm]
    palm["instances"] = placed(places(palms, 0.3), 0.8, 1.2)
    if not palms:
        scene["objects"].remove(palm)
    if stones:
        data = encode_glb([Lod(sphere(3 - i), 0.0, 0.0) for i in range(len(ERRORS))], "stone")
        (folder / "stone.glb").write_bytes(data)
        same = next(entry for entry in scene["artifacts"].values() if entry["kind"] == "mesh")
        scene["artifacts"]["stone"] = same | identity(data) | {"file": "stone.glb", "levels": []}
        scene["streaming"].append("stone")
        scene["objects"].append(
            {
                "name": "stone",
                "views": ["camera", "shadow", "reflection", "refraction"],
                "mesh": "stone",
                "center": [0.0, 0.0, 0.0],
                "radius_m": 1.0,
                "lods": [{"node": f"lod{i}", "error_m": error} for i, error in enumerate(ERRORS)],
                "materials": {"stone": material(None, color=[0.4, 0.38, 0.35])},
                "instances": placed(places(stones, -4.0), 0.03, 0.2),
            }
        )
    (folder / "scene.json").write_text(json.dumps(scene))
    return folder
