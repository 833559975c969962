"""UV layouts beside xatlas with its own settings, at one size and gutter; metrics/atlas.py judges both.

Times are those of the processor, on all threads together: xatlas starts one a core.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xatlas

import meshes
from paradize.data import Mesh
from paradize.metrics.atlas import atlas_quality
from paradize.readers.obj import read_obj
from paradize.stages.atlas import PADDING, RESOLUTION, make_atlas
from paradize.stages.split import split_by
from row import BASELINE, CORES, Row, on, pair_ms
from tests.places import CORPUS, ROOT

SCANS = (
    "obj-large/spot.obj",
    "tangent/Corset/Corset.obj",
    "obj-materials/panda-hand/hand.obj",
)  # of the corpus


def closed(mesh: Mesh) -> Mesh:
    """The same surface with one vertex a place, three metres in radius: what a scanner gives."""
    points, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    triangles = place.reshape(-1)[mesh.triangles].astype(np.uint32)
    return Mesh(np.ascontiguousarray(points * np.float32(3)), np.ascontiguousarray(triangles))


def plain_xatlas(mesh: Mesh) -> Mesh:
    """xatlas as it comes but for the size and the gutter that ours has too; its oblong made square."""
    atlas = xatlas.Atlas()
    atlas.add_mesh(mesh.positions, mesh.triangles)
    packing = xatlas.PackOptions()
    packing.resolution, packing.padding = RESOLUTION, PADDING
    atlas.generate(xatlas.ChartOptions(), packing, False)
    _, triangles, uvs = atlas[0]
    sides = np.array([atlas.width, atlas.height], np.float32) / max(atlas.width, atlas.height)
    return split_by(mesh, uvs=np.ascontiguousarray((uvs * sides)[triangles], np.float32))


def quality_text(mesh: Mesh) -> str:
    found: dict[str, Any] = atlas_quality(mesh)
    return (
        f"stretch {found['stretch']:.4f}, packing {found['packing']:.2f}, seams {found['seam_length']:.1f}, "
        f"{found['charts']} charts, {found['flipped']} triangles mirrored"
    )


def rows(runs: int, folder: Path) -> Iterator[Row]:
    surfaces = {
        name: closed(getattr(meshes, name)(count)) for name, count in (("sphere", 50_000), ("torus", 50_000))
    }
    # Hundreds of charts: planks and poles that touch nothing.
    surfaces["jetty"] = closed(read_obj(ROOT / "raw_assets/jetty/jetty.obj").mesh)
    for file in SCANS:
        if (CORPUS / file).is_file():
            surfaces[Path(file).stem] = closed(read_obj(CORPUS / file).mesh)
        else:
            print(f"no {file} in the corpus at {CORPUS}: its row is left out\n", flush=True)
    for name, mesh in surfaces.items():
        works = (lambda m=mesh: make_atlas(m), lambda m=mesh: plain_xatlas(m))
        times = pair_ms(*works, max(1, runs // 9), time.process_time)
        work = f"atlas, {name} of {len(mesh.triangles)} triangles"
        limit = 2.0 if name in ("sphere", "torus") else None
        yield Row(
            work, times[0], "xatlas", times[1],
            quality_text(make_atlas(mesh)), quality_text(plain_xatlas(mesh)), limit=limit,
            inside="a mesh in memory to charts, UVs and split vertices", ours_on=on(CORES),
            peer_on=on(CORES, BASELINE),
        )  # fmt: skip
