"""Speed and error as ratios beside peers, all measured in this run; prints one table.

usage: bench.py [--runs N]

A row: the work, our median time, the peer and its median time, the ratio (above 1: we are faster), our error
and the peer's against an analytic or float64 reference. Errors are not inside the times.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import openmesh

from paradize.kernels import maps
from paradize.kernels.obj import parse_obj
from paradize.metrics.surface import surface_distance
from paradize.readers.obj import read_obj
from paradize.stages.lod import simplify
from paradize.stages.mips import color_mips

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Row:
    work: str
    ours_ms: float
    peer: str
    peer_ms: float
    ours_error: str
    peer_error: str


def median_ms(work: Callable[[], Any], runs: int) -> float:
    """Median wall time of `runs` calls after one that is not counted."""
    work()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append((time.perf_counter() - start) * 1e3)
    return statistics.median(times)


def waves(size: int) -> tuple[np.ndarray, np.ndarray]:
    """A periodic field of 40 sinusoids of 8 to 64 texels, and its exact unit normals in float64."""
    rng = np.random.default_rng(7)
    x = np.arange(size) / size * 2 * np.pi
    heights = np.zeros((size, size))
    slope_x, slope_y = np.zeros_like(heights), np.zeros_like(heights)
    for _ in range(40):
        wavelength = 2 ** rng.uniform(3, 6)
        angle, phase = rng.uniform(0, 2 * np.pi, 2)
        kx, ky = np.round(size / wavelength * np.array([np.cos(angle), np.sin(angle)]))
        amplitude = wavelength / (2 * np.pi) / np.sqrt(20)
        inside = kx * x[None, :] + ky * x[:, None] + phase
        heights += amplitude * np.sin(inside)
        slope_x += amplitude * kx * 2 * np.pi / size * np.cos(inside)
        slope_y += amplitude * ky * 2 * np.pi / size * np.cos(inside)
    normals = np.stack([-slope_x, slope_y, np.ones_like(heights)], axis=2)
    return heights.astype(np.float32), normals / np.linalg.norm(normals, axis=2, keepdims=True)


def degrees(a: np.ndarray, b: np.ndarray) -> str:
    cross = np.linalg.norm(np.cross(a.astype(np.float64), b), axis=2)
    angle = np.degrees(np.arctan2(cross, (a * b).sum(axis=2)))
    return f"mean {angle.mean():.3f}, p99 {np.percentile(angle, 99):.3f} deg"


def bench_normals(runs: int) -> Row:
    size = 2048
    heights, exact = waves(size)

    def numpy_central() -> np.ndarray:
        dx = (np.roll(heights, -1, 1) - np.roll(heights, 1, 1)) * 0.5
        dy = (np.roll(heights, -1, 0) - np.roll(heights, 1, 0)) * 0.5
        normals = np.stack([-dx, dy, np.ones_like(heights)], axis=2)
        return normals / np.sqrt((normals * normals).sum(axis=2, keepdims=True))

    def ours() -> np.ndarray:
        return maps.normals_from_heights(heights, scale=(1.0, 1.0), filter_name="fourth", wrap=(True, True))

    times = median_ms(ours, runs), median_ms(numpy_central, runs)
    return Row(
        f"normals from heights, {size}^2 float", times[0], "numpy, central differences", times[1],
        degrees(ours(), exact), degrees(numpy_central(), exact),
    )  # fmt: skip


def bench_mips(runs: int) -> Row:
    size = 2048
    rng = np.random.default_rng(3)
    linear = rng.random((size, size, 3), dtype=np.float32)
    image = oiio.ImageBuf(linear)

    def peer() -> oiio.ImageBuf:
        level, side = image, size
        while side > 1:
            side //= 2
            level = oiio.ImageBufAlgo.resize(level, filtername="box", roi=oiio.ROI(0, side, 0, side))
        return level

    exact = linear.astype(np.float64).mean(axis=(0, 1))
    ours_error = np.abs(color_mips(linear)[-1].reshape(-1)[:3] - exact).max()
    peer_error = np.abs(peer().get_pixels(oiio.FLOAT).reshape(-1)[:3] - exact).max()
    times = median_ms(lambda: color_mips(linear), runs), median_ms(peer, max(1, runs // 3))
    return Row(
        f"linear mip chain, {size}^2 RGB float", times[0], "OpenImageIO resize, box", times[1],
        f"last level off by {ours_error:.1e}", f"{peer_error:.1e}",
    )  # fmt: skip


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


def bench_obj(runs: int, folder: Path) -> Row:
    text = grid_obj(400)
    file = folder / "grid.obj"
    file.write_bytes(text)
    times = (
        median_ms(lambda: parse_obj(file.read_bytes()), runs),
        median_ms(lambda: openmesh.read_trimesh(str(file)), max(1, runs // 3)),
    )
    return Row(
        f"OBJ to arrays, {len(text) / 1e6:.0f} MB",
        times[0],
        "OpenMesh (without vt, vn)",
        times[1],
        "exact",
        "-",
    )


def bench_lods(runs: int, folder: Path) -> Row:
    file = folder / "grid.obj"
    mesh = read_obj(file).mesh
    target = mesh.triangles.shape[0] // 10
    ours, peer = (simplify(mesh, target, tier).mesh for tier in ("balanced", "fast"))
    errors = [surface_distance(mesh, level, 200_000) for level in (ours, peer)]
    times = [median_ms(lambda t=tier: simplify(mesh, target, t), runs) for tier in ("balanced", "fast")]
    texts = [f"rms {e['error_rms']:.2e}, max {e['error_max']:.2e} of the diagonal" for e in errors]
    work = f"LOD {mesh.triangles.shape[0]} -> {ours.triangles.shape[0]} triangles, tier balanced"
    return Row(work, times[0], f"tier fast, -> {peer.triangles.shape[0]}", times[1], texts[0], texts[1])


def bench_no_op(runs: int) -> Row:
    scene, out = ROOT / "raw_assets/island.toml", ROOT / "build/assets/island"
    command = [str(ROOT / "build/venv/bin/paradize"), "bake", str(scene), "-o", str(out), "--json"]
    first = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    python = [sys.executable, "-c", "pass"]
    times = (
        median_ms(lambda: subprocess.run(command, capture_output=True, check=True), runs),
        median_ms(lambda: subprocess.run(python, check=True), runs),
    )
    reused = f"{len(first['artifacts'])} artifacts kept"
    return Row("island, nothing changed", times[0], "python -c pass", times[1], reused, "-")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--runs", type=int, default=9, help="timed runs of each work (default 9)")
    runs = parser.parse_args().runs
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [
            bench_normals(runs),
            bench_mips(runs),
            bench_obj(runs, folder),
            bench_lods(runs, folder),
            bench_no_op(runs),
        ]
    for row in rows:
        print(f"{row.work}\n    ours  {row.ours_ms:9.1f} ms   {row.ours_error}")
        print(f"    peer  {row.peer_ms:9.1f} ms   {row.peer_error}   ({row.peer})")
        print(f"    ratio {row.peer_ms / row.ours_ms:9.2f} x\n")


if __name__ == "__main__":
    main()
