"""LODs beside fast-simplification."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from paradize.metrics.surface import surface_distance
from paradize.readers.obj import read_obj
from paradize.stages.lod import simplify
from row import Row, median_ms


def grid_obj(side: int) -> bytes:
    """A wavy grid with v, vt, vn as OBJ text."""
    x, y = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    z = 0.05 * np.sin(17 * x) * np.cos(13 * y)
    lines = [f"v {a:.6f} {b:.6f} {c:.6f}" for a, b, c in zip(x.flat, z.flat, y.flat, strict=True)]
    lines += [f"vt {a:.6f} {b:.6f}" for a, b in zip(x.flat, y.flat, strict=True)]
    lines += [f"vn {-0.85 * np.cos(17 * a):.4f} 1.0 {0.65 * np.sin(13 * a):.4f}" for a in x.flat]
    index = np.arange(side * side).reshape(side, side) + 1
    for a, b, c, d in zip(
        index[:-1, :-1].flat, index[1:, :-1].flat, index[1:, 1:].flat, index[:-1, 1:].flat, strict=True
    ):
        lines.append(f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c} {d}/{d}/{d}")
    return "\n".join(lines).encode() + b"\n"


def bench_lods(runs: int, folder: Path) -> Row:
    file = folder / "grid.obj"
    file.write_bytes(grid_obj(400))
    mesh = read_obj(file).mesh
    target = mesh.triangles.shape[0] // 10
    ours, peer = (simplify(mesh, target, tier).mesh for tier in ("balanced", "fast"))
    errors = [surface_distance(mesh, level, 200_000) for level in (ours, peer)]
    times = [median_ms(lambda t=tier: simplify(mesh, target, t), runs) for tier in ("balanced", "fast")]
    texts = [f"rms {e['error_rms']:.2e}, max {e['error_max']:.2e} of the diagonal" for e in errors]
    work = f"LOD {mesh.triangles.shape[0]} -> {ours.triangles.shape[0]} triangles, tier balanced"
    return Row(work, times[0], f"tier fast, -> {peer.triangles.shape[0]}", times[1], texts[0], texts[1])


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield bench_lods(runs, folder)
