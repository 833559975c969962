"""Terrain meshes beside pydelatin and pymartini; true errors by the reference rasteriser.

At 513 x 513 twice: Mount Fuji, the tile that pymartini's own example shows, from the corpus; and a field so
rough down to its pixels that most of them are needed.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pydelatin
import pymartini

from paradize.data import Heightfield
from paradize.kernels.reference.terrain import terrain_error
from paradize.kernels.terrain import refine
from paradize.stages.terrain import terrain_mesh
from row import BASELINE, CORES, Row, on, pair_ms
from tests.places import CORPUS

RANGE_M = 3800.0
INSIDE = "heights in memory to vertices and triangles"


def rough_field(side: int) -> npt.NDArray[np.float32]:
    """Noise of all octaves from 8 cells down to a pixel, bilinear, gain 0.52: side x side over 3,800 m."""
    rng = np.random.default_rng(1)
    heights = np.zeros((side, side))
    cells, gain = 8, 1.0
    while cells < side:
        grid = rng.normal(size=(cells + 1, cells + 1))
        at = np.arange(side) * (cells / side)
        low = at.astype(int)
        share = at - low
        rows = grid[low] * (1.0 - share[:, None]) + grid[low + 1] * share[:, None]
        heights += gain * (rows[:, low] * (1.0 - share) + rows[:, low + 1] * share)
        cells, gain = 2 * cells, 0.52 * gain
    heights -= heights.min()
    return np.ascontiguousarray(heights * (RANGE_M / heights.max()), dtype=np.float32)


def true_error(
    heights: npt.NDArray[np.float32],
    pixels: npt.NDArray[np.integer],
    triangles: npt.NDArray[np.integer],
) -> float:
    """pixels: (n, 2) as (row, column); triangles in either turn."""
    size = float(heights.shape[0] - 1)
    positions = np.empty((len(pixels), 3), np.float32)
    positions[:, 0] = pixels[:, 1] - size / 2
    positions[:, 2] = pixels[:, 0] - size / 2
    positions[:, 1] = heights[pixels[:, 0], pixels[:, 1]]
    both = np.concatenate([triangles, triangles[:, ::-1]]).astype(np.uint32)
    return terrain_error(positions, both, heights, (size, size))[0]


def error_text(count: int, error: float) -> str:
    return f"{count} triangles, true error {error:.2f} m"


def bench_delatin(runs: int) -> Iterator[Row]:
    heights = rough_field(4097)
    pixels, triangles = refine(heights, 10.0)
    # Its y runs upwards: the field goes in upside down, so that its vertices are ours.
    upside = np.ascontiguousarray(heights[::-1])
    peer = pydelatin.Delatin(upside, max_error=10.0, width=4097, height=4097)
    texts = (
        error_text(len(triangles), true_error(heights, pixels, triangles)),
        f"{len(peer.triangles)} triangles",
    )
    for threads in dict.fromkeys((1, CORES)):
        times = pair_ms(
            lambda threads=threads: refine(heights, 10.0, threads=threads),
            lambda: pydelatin.Delatin(upside, max_error=10.0, width=4097, height=4097).triangles,
            max(1, runs // 4),
        )
        yield Row(
            "Terrain 4097 x 4097, 10 m of 3,800 m", times[0], "pydelatin", times[1], *texts,
            limit=3.0 if threads == 1 else None, inside=INSIDE, ours_on=on(threads), peer_on=on(1, BASELINE),
        )  # fmt: skip


def fuji() -> npt.NDArray[np.float32] | None:
    """513 x 513, metres: decoded from the tile's colours, its last row and column repeated."""
    path = CORPUS / "height" / "fuji_512_rgb.png"
    if not path.is_file():
        return None
    r, g, b = np.moveaxis(np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8), np.float64), 2, 0)[:3]
    heights = -10000.0 + (r * 65536.0 + g * 256.0 + b) * 0.1
    return np.ascontiguousarray(np.pad(heights, ((0, 1), (0, 1)), "edge"), np.float32)


def bench_martini(name: str, heights: npt.NDArray[np.float32], runs: int) -> Iterator[Row]:
    """From a field alone, the peer's tables for its size counted; and beside it a further field of a size
    whose tables the peer has, which ours has no use for."""
    maker = pymartini.Martini(513)

    def martini() -> tuple[npt.NDArray[np.integer], npt.NDArray[np.integer]]:
        vertices, triangles = maker.create_tile(heights).get_mesh(10.0)
        return np.asarray(vertices).reshape(-1, 2)[:, ::-1].astype(np.int64), np.asarray(triangles).reshape(
            -1, 3
        ).astype(np.int64)

    peer = martini()
    error = true_error(heights, *peer)
    ours = refine(heights, error)
    texts = error_text(len(ours[1]), true_error(heights, *ours)), error_text(len(peer[1]), error)
    first = pair_ms(
        lambda: refine(heights, error),
        lambda: pymartini.Martini(513).create_tile(heights).get_mesh(10.0),
        max(runs, 21),
    )
    further = pair_ms(
        lambda: refine(heights, error), lambda: maker.create_tile(heights).get_mesh(10.0), max(runs, 21)
    )
    what = f"Terrain 513 x 513, {name}, at the peer's true error"
    sides = {"inside": INSIDE, "ours_on": on(CORES), "peer_on": on(1, BASELINE)}
    yield Row(what, first[0], "pymartini", first[1], *texts, limit=1.0, **sides)
    yield Row(f"{what}, its tables kept", further[0], "pymartini", further[1], *texts, **sides)


def bench_grid(runs: int, folder: Path) -> Row:
    """Every pixel a vertex, beside a plain write of the same arrays to a file that nobody flushes."""
    field = Heightfield(rough_field(4097), 4096.0, 4096.0)
    path = folder / "grid.bin"
    mesh = terrain_mesh(field, tolerance_m=0.0, tier="grid")
    made = mesh.positions, mesh.normals, mesh.tangents, mesh.uvs, mesh.uvs1, mesh.triangles
    arrays = [array for array in made if array is not None]

    def write() -> None:
        with path.open("wb") as file:
            for array in arrays:
                array.tofile(file)

    size = sum(array.nbytes for array in arrays) / 1e6
    times = pair_ms(lambda: terrain_mesh(field, tolerance_m=0.0, tier="grid"), write, max(1, runs // 2))
    path.unlink()
    texts = f"{len(mesh.triangles)} triangles, normals, tangents, two UV sets", f"{size:.0f} MB"
    return Row(
        "Terrain 4097 x 4097, every pixel", times[0], "plain write", times[1], *texts, limit=0.5,
        inside="ours: heights to a mesh's arrays; the peer's: those arrays to a file, not flushed",
        ours_on=on(CORES), peer_on=on(1),
    )  # fmt: skip


def rows(runs: int, folder: Path) -> Iterator[Row]:
    yield from bench_delatin(runs)
    mountain = fuji()
    if mountain is None:
        print(f"no corpus at {CORPUS}: the rows of Mount Fuji are left out\n", flush=True)
    else:
        yield from bench_martini("Mount Fuji", mountain, runs)
    yield from bench_martini("rough", rough_field(513), runs)
    yield bench_grid(runs, folder)
