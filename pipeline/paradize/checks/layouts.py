"""Rules for the UV layout of an object: range, overlap, texel density."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.checks.rules import Finding, isolated
from paradize.data import Mesh
from paradize.errors import ParadizeError
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.scene.manifest import map_sets, read_entry
from paradize.kernels.reference.atlas import layout_raster
from paradize.metrics.texels import decode_texels
from paradize.vectors import doubled_areas, doubled_areas_2d

_BEYOND = 1e-4  # of the side: rounding may move a coordinate out by this
_SIDE = 512  # texels a side of the raster in which overlap is searched
_EDGE = (
    16.0 / 255.0
)  # difference of neighbouring texels that counts as an edge; a compressed gradient has less
_PLAIN = 0.05  # share of the area that shows edges, up to which a map counts as a palette
# Inside the triangle: its corners may lie on the centres of texels, where nothing is mixed.
_FEW = 10_000  # triangles, up to which edges are looked for more closely
_OVERLAP = 0.05  # of the covered texels
_LIT = 1.0 - 1.5 / 255.0  # share of the light that arrives, from which on a texel is not in shade
_UNEVEN = 8.0  # texels a metre: the densest twentieth of the area over the sparsest


def check_layouts(manifest: dict[str, Any], folder: Path) -> Iterator[Finding]:
    """The findings in the layouts of the objects whose UVs are said to stay inside their maps. Another rule
    reports meshes that cannot be read."""
    for item in manifest["objects"]:
        sets = [entry for entry in map_sets(item) if entry[0]["wrap"] is None and entry[0]["maps"]["color"]]
        if not sets:
            continue
        entry = manifest["artifacts"][item["mesh"]]
        file = str(folder / entry["file"])
        try:
            whole = decode_glb(read_entry(folder, entry))[0].mesh
        except (OSError, ParadizeError):
            continue
        for material, names in sets:
            mesh = whole.of_materials(names)
            if mesh.uvs is not None:
                color = manifest["artifacts"][material["maps"]["color"]]
                picture, edge = partial(read_entry, folder, color), _EDGE
                if color["gutter"] is None and color["max_level"] is not None and color["required_detail"]:
                    edge *= (
                        1 << color["required_detail"]["left_out"]
                    )  # a palette's gradients, now as much steeper
                shaded = _is_shaded(manifest, folder, material)
                findings = check_layout(mesh, mesh.uvs, file, picture, edge, shaded=shaded)
                yield from isolated(findings, file)


def _is_shaded(manifest: dict[str, Any], folder: Path, material: dict[str, Any]) -> bool:
    """Whether an occlusion map darkens places of a material. One without shade holds metalness alone."""
    name = material["maps"]["occlusion"]
    if name is None or material["occlusion_strength"] == 0.0:
        return False
    try:
        texels = decode_texels(decode_ktx2(read_entry(folder, manifest["artifacts"][name])))
    except (OSError, ParadizeError):  # another rule reports it
        return False
    return bool(texels[:, :, 0].min() < _LIT)


def check_layout(
    mesh: Mesh,
    uvs: npt.NDArray[np.float32],
    file: str,
    picture: Callable[[], bytes],
    edge: float = _EDGE,
    *,
    shaded: bool = True,
) -> Iterator[Finding]:
    """The findings in the layout of one map set. mesh: its triangles, with these UVs. file: for messages.
    picture: returns the KTX2 of its colour map. edge: difference of neighbours that counts as one. shaded:
    whether an occlusion map darkens it, which holds one place for each texel; sheets of colour are tiled and
    mirrored on purpose."""
    used = np.flatnonzero(mesh.is_used)  # other materials of the model may repeat their maps
    outside = np.abs(uvs[used] - 0.5).max(axis=1) - 0.5
    bad = outside > _BEYOND
    if bad.any():
        worst = int(used[outside.argmax()])
        what = f"a coordinate of {', '.join(f'{value:.6g}' for value in uvs[worst])}"
        yield Finding("PZ231", file, what, f"lod0 vertex {worst}", int(bad.sum()))
        return
    corners = np.clip(uvs[mesh.triangles].astype(np.float64), 0.0, 1.0)
    area = doubled_areas(mesh.positions[mesh.triangles].astype(np.float64))
    painted = _painted(corners, picture, edge)
    if area[painted].sum() <= _PLAIN * area.sum():
        return
    shown, corners = mesh.triangles[painted], corners[painted]
    points = mesh.positions.astype(np.float64)
    places = np.unique(mesh.positions, axis=0, return_inverse=True)[1].reshape(-1)
    spread = np.zeros((int(places.max()) + 1, 3))
    spread[places] = points
    size = float(np.ptp(points, axis=0).max()) or 1.0
    triangles = places[shown].astype(np.uint32)
    if shaded:
        covered, twice, _ = layout_raster(
            (points - points.min(axis=0)) / size, shown, corners, resolution=_SIDE, gap=0
        )
        if covered and twice > _OVERLAP * covered:
            what = f"{100.0 * twice / covered:.0f} % of the covered texels belong to several places"
            yield Finding("PZ232", file, what, "lod0")
    yield from _density(spread, triangles, corners, file)


def _painted(
    corners: npt.NDArray[np.float64], picture: Callable[[], bytes], most: float
) -> npt.NDArray[np.bool_]:
    """Which triangles show edges of the colour map: neighbours that differ by more than `most`. Those
    without, as on swatches and gradients of a palette, may share texels, and their density means nothing.
    corners: (m, 3, 2) texture coordinates."""
    try:
        colors = decode_texels(decode_ktx2(picture()))[:, :, :3]
    except (OSError, ParadizeError):  # another rule reports it
        return np.ones(len(corners), np.bool_)
    # Between the centres of four texels their colours are mixed; cell (0, 0) ends at the first centre.
    around = np.pad(colors, ((1, 1), (1, 1), (0, 0)), mode="edge")
    across, down = (
        np.maximum.reduce([np.abs(np.diff(around[:, :, k], axis=axis)) for k in range(colors.shape[2])])
        > most
        for axis in (1, 0)
    )
    edge = across[:-1] | across[1:] | down[:, :-1] | down[:, 1:]
    found = np.zeros(len(corners), np.bool_)
    steps = 32 if len(corners) <= _FEW else 10
    samples = [[a, b, steps - a - b] for a in range(steps + 1) for b in range(steps + 1 - a)]
    left, size = np.arange(len(corners)), np.array(colors.shape[1::-1])
    for a, b, c in (np.array(samples, np.float64) + 1.0 / 3.0) / (steps + 1.0):
        places = (corners[:, 0] * a + corners[:, 1] * b + corners[:, 2] * c) * size + 0.5
        column, row = places.astype(np.int64).T
        shows = edge[row, column]
        if shows.any():
            found[left[shows]] = True
            left, corners = left[~shows], corners[~shows]
    return found


def _density(
    points: npt.NDArray[np.float64],
    triangles: npt.NDArray[np.uint32],
    corners: npt.NDArray[np.float64],
    file: str,
) -> Iterator[Finding]:
    """Compares the densest twentieth of the area that has texels with the sparsest."""
    area = doubled_areas(points[triangles])
    image = np.abs(doubled_areas_2d(corners))
    seen = (area > 0.0) & (image > 0.0)
    if not seen.any():
        return
    density = np.sqrt(image[seen] / area[seen])
    order = np.argsort(density, kind="stable")
    share = np.cumsum(area[seen][order])
    sparse, dense = (
        order[min(np.searchsorted(share, part * share[-1]), len(order) - 1)] for part in (0.05, 0.95)
    )
    ratio = float(density[dense] / density[sparse])
    if ratio > _UNEVEN:
        at = np.flatnonzero(seen)[sparse]
        what = f"a twentieth of its area has {ratio:.1f} times the texels of another twentieth"
        yield Finding("PZ233", file, what, f"lod0 triangle {int(at)}")
