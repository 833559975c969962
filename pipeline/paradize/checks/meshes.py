"""Rules for a GLB: indices, numbers, normals, tangent frames, levels of detail."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

import numpy as np
import numpy.typing as npt

from paradize.checks.glb_arrays import Level, Primitive, read_levels
from paradize.checks.rules import Finding
from paradize.errors import FormatError
from paradize.kernels.reference import Surface
from paradize.vectors import doubled_areas_2d

_ROUNDING = 1e-7  # of the diagonal: errors that differ by less are equal, because positions are float32
_APART = 1e-4  # share by which rounding may lift a measured distance above the stated bound
_SAMPLES = 2_000  # in addition to ten in every triangle
_STRETCHED = 0.05  # the share of a material's area that has fewer texture coordinates per metre
_SLACK, _NEAR = 0.01, 1e-3  # of that share, and of the number: rounding moves small triangles
_SIX_DIGITS, _TINY = 1e-5, 1e-30
_UNIT = 2e-3  # how far a length may be from 1 and a dot product from 0, in addition to quantisation


def check_mesh(data: bytes, file: str) -> Iterator[Finding]:
    """The findings in a GLB's bytes."""
    try:
        levels = read_levels(data, file)
    except FormatError as error:
        yield Finding("PZ102", file, error.what, error.place or "")
        return
    if not any(level.primitives for level in levels):
        yield Finding("PZ208", file, "no node has a mesh to draw")
    seen: set[object] = set()
    for level in levels:
        for primitive in level.primitives:
            where = f"{level.name} {primitive.place}"
            # Primitives often share their vertices: a fault of those is reported once.
            vertices = tuple(sorted((name, id(values)) for name, values in primitive.attributes.items()))
            if vertices not in seen:
                yield from _vertices(primitive, file, where)
            if (vertices, id(primitive.indices)) not in seen:
                yield from _triangles(primitive, file, where)
            seen |= {vertices, (vertices, id(primitive.indices))}
    order = list(_order(levels, file))
    yield from order or (*_distance(levels, file), *_measures(levels, file))


def _rows(bad: npt.NDArray[np.bool_]) -> tuple[int, int]:
    """(the number of rows, the first)."""
    return int(bad.sum()), int(np.argmax(bad))


def _length(v: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
    with np.errstate(invalid="ignore"):  # rows that are not finite have their own finding
        wide = v.astype(np.float64)
        return np.asarray(np.sqrt((wide * wide).sum(axis=1)), np.float64)


def _vertices(primitive: Primitive, file: str, where: str) -> Iterator[Finding]:
    attributes = primitive.attributes
    positions = attributes.get("POSITION")
    if positions is None:
        yield Finding("PZ102", file, "a primitive without positions", where)
        return
    finite = np.ones(len(positions), bool)
    for name, values in attributes.items():
        bad = np.asarray(~np.isfinite(values).all(axis=1))
        if bad.any():
            count, first = _rows(bad)
            yield Finding(
                "PZ202", file, f"{name} holds {values[first].tolist()}", f"{where} vertex {first}", count
            )
        if len(values) == len(finite):
            finite &= ~bad
        else:
            yield Finding("PZ102", file, f"{len(values)} of {name} for {len(finite)} vertices", where)
            return
    normals = attributes.get("NORMAL")
    if normals is None:
        return
    length = _length(np.where(finite[:, None], normals, [1.0, 0.0, 0.0]))
    slack = primitive.slack.get("NORMAL", 0.0)
    bad = np.abs(length - 1.0) > _UNIT + slack
    if bad.any():
        count, first = _rows(bad)
        yield Finding("PZ203", file, f"a length of {length[first]:.4g}", f"{where} vertex {first}", count)
    if "TANGENT" in attributes:
        slack = max(slack, primitive.slack.get("TANGENT", 0.0))
        yield from _tangents(normals, attributes["TANGENT"], finite & ~bad, slack, file, where)


def _triangles(primitive: Primitive, file: str, where: str) -> Iterator[Finding]:
    positions, indices = primitive.attributes.get("POSITION"), primitive.indices
    if positions is None or indices is None:
        return
    bad = indices >= len(positions)
    if bad.any():
        count, first = _rows(bad)
        what = f"index {int(indices[first])} of {len(positions)} vertices"
        yield Finding("PZ201", file, what, f"{where} corner {first}", count)
    elif len(indices) % 3:
        yield Finding("PZ102", file, f"{len(indices)} indices are no triangles", where)
    else:
        yield from _degenerate(positions, indices.reshape(-1, 3), file, where)


def _tangents(
    normals: npt.NDArray[np.float32],
    tangents: npt.NDArray[np.float32],
    sound: npt.NDArray[np.bool_],
    slack: float,
    file: str,
    where: str,
) -> Iterator[Finding]:
    length = _length(tangents[:, :3])
    with np.errstate(invalid="ignore"):
        lean = np.abs((normals.astype(np.float64) * tangents[:, :3]).sum(axis=1))
    bad = sound & ((np.abs(length - 1.0) > _UNIT + slack) | (lean > _UNIT + 3.0 * slack))
    if bad.any():
        count, first = _rows(bad)
        what = f"a tangent of length {length[first]:.4g} that leans {lean[first]:.4g} along the normal"
        yield Finding("PZ204", file, what, f"{where} vertex {first}", count)
    bad = sound & (np.abs(tangents[:, 3]) != 1.0)
    if bad.any():
        count, first = _rows(bad)
        yield Finding("PZ205", file, f"a sign of {tangents[first, 3]:g}", f"{where} vertex {first}", count)


def _degenerate(
    positions: npt.NDArray[np.float32], triangles: npt.NDArray[np.integer], file: str, where: str
) -> Iterator[Finding]:
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    same = (a == b).all(axis=1) | (b == c).all(axis=1) | (c == a).all(axis=1)
    if same.any():
        count, first = _rows(same)
        yield Finding(
            "PZ206", file, "two corners of a triangle are one place", f"{where} triangle {first}", count
        )


def _order(levels: list[Level], file: str) -> Iterator[Finding]:
    lods = [level for level in levels if "error_max" in level.extras]
    triangles = [
        sum(len(p.indices) // 3 for p in level.primitives if p.indices is not None) for level in lods
    ]
    for k in range(1, len(lods)):
        if triangles[k] > triangles[k - 1]:
            what = f"{triangles[k]} triangles after {triangles[k - 1]}"
            yield Finding("PZ207", file, what, lods[k].name)
    for k, level in enumerate(lods):
        errors = [level.extras.get(name) for name in ("error_max", "error_rms")]
        if not all(isinstance(error, int | float) and 0.0 <= error < float("inf") for error in errors):
            yield Finding("PZ207", file, f"errors of {errors}", level.name)
            return
        if k and level.extras["error_max"] < lods[k - 1].extras["error_max"] - _ROUNDING:
            what = f"an error of {level.extras['error_max']:g} after {lods[k - 1].extras['error_max']:g}"
            yield Finding("PZ207", file, what, level.name)


def _distance(levels: list[Level], file: str) -> Iterator[Finding]:
    """Levels whose surface, measured again where their nodes stand, is farther from the finest level than
    their error_max says."""
    lods = [level for level in levels if isinstance(level.extras.get("error_max"), int | float)]
    surfaces = [_surface(level, lods[0]) for level in lods]
    if len(lods) < 2 or any(surface is None for surface in surfaces):
        return
    truth = surfaces[0]
    assert truth is not None
    sides = np.ptp(truth.positions.astype(np.float64), axis=0)
    diagonal = float(np.sqrt((sides * sides).sum()))
    if not 0.0 < diagonal < float("inf"):
        return
    # Errors are shares of the source's diagonal; the finest level of the file may be off the source as well.
    off = float(lods[0].extras["error_max"])
    wider = 1.0 + 2.0 * sqrt(3.0) * off
    for level, surface in zip(lods[1:], surfaces[1:], strict=True):
        assert surface is not None
        distance = surface.distance_to(truth, samples=_SAMPLES)[0] / diagonal
        limit = (float(level.extras["error_max"]) + off) * wider
        if distance > limit * (1.0 + _APART) + 1e-6:
            what = f"its surface lies {distance:.3g} of the diagonal from the finest level, "
            what += f"its error_max is {limit:.3g}"
            yield Finding("PZ209", file, what, level.name)


def _measures(levels: list[Level], file: str) -> Iterator[Finding]:
    """Materials whose measures are not those of their triangles in the coarsest level."""
    lods = [level for level in levels if "error_max" in level.extras]
    coarsest = lods[-1].primitives if lods else ()
    for material in dict.fromkeys(primitive.material for primitive in coarsest):
        parts = [primitive for primitive in coarsest if primitive.material == material]
        where = f"/materials/{material}/extras"
        corners = _corners(parts, "POSITION")
        if corners is None:
            continue  # other rules report it
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        off = _SIX_DIGITS * (np.abs(low) + np.abs(high)) + _TINY
        center = parts[0].measures.get("center")
        try:
            stated = np.array(center, np.float64)
        except (TypeError, ValueError):
            stated = np.array(np.nan)
        if stated.shape != (3,) or not (np.abs(stated - (low + high) / 2.0) <= off).all():
            middle = ", ".join(f"{x:.6g}" for x in (low + high) / 2.0)
            yield Finding("PZ210", file, f"center is {center!s:.60}, the triangles' is {middle}", where)
        edges = (corners[:, 1:] - corners[:, :1]) * lods[-1].scale
        areas = _length(np.cross(edges[:, 0], edges[:, 1]))
        for key, attribute in (("uv_per_m", "TEXCOORD_0"), ("uv1_per_m", "TEXCOORD_1")):
            uvs = _corners(parts, attribute)
            if uvs is not None and len(uvs) == len(areas):
                yield from _density(parts[0].measures.get(key), key, areas, uvs, file, where)


def _corners(parts: list[Primitive], attribute: str) -> npt.NDArray[np.float64] | None:
    """The values of an attribute at the corners of all triangles, (n, 3, k); None where there are none or
    other rules report faults."""
    out = []
    for part in parts:
        values, indices = part.attributes.get(attribute), part.indices
        if values is None or indices is None or not len(indices) or len(indices) % 3:
            return None
        if not np.isfinite(values).all() or int(indices.max()) >= len(values):
            return None
        out.append(values[indices.reshape(-1, 3)].astype(np.float64))
    return np.concatenate(out)


def _density(
    stated: object,
    key: str,
    areas: npt.NDArray[np.float64],
    uvs: npt.NDArray[np.float64],
    file: str,
    where: str,
) -> Iterator[Finding]:
    """A number of texture coordinates per metre that not about a twentieth of the area stays below."""
    if isinstance(stated, bool) or not isinstance(stated, int | float) or not 0 <= stated < float("inf"):
        yield Finding("PZ210", file, f"{key} is {stated!s:.60}", where)
        return
    drawn = areas > 0.0
    total = float(areas[drawn].sum())
    if total == 0.0:
        return
    density = np.minimum(np.sqrt(np.abs(doubled_areas_2d(uvs[drawn])) / areas[drawn]), 1e30)  # FORMAT.md
    below = float(areas[drawn][density < stated * (1.0 - _NEAR)].sum()) / total
    up_to = float(areas[drawn][density <= stated * (1.0 + _NEAR) + _TINY].sum()) / total
    if below > _STRETCHED + _SLACK or up_to < _STRETCHED - _SLACK:
        what = f"{key} is {stated:.6g}: {below:.1%} of the area has fewer texture coordinates per metre, "
        yield Finding("PZ210", file, what + f"{up_to:.1%} no more; 5 % must", where)


def _surface(level: Level, finest: Level) -> Surface | None:
    """The triangles of a level, in metres from the node of the finest level; None if it has none, or faults
    that other rules report."""
    positions, triangles, count = [], [], 0
    seen: set[tuple[int, int]] = set()
    for primitive in level.primitives:
        places, indices = primitive.attributes.get("POSITION"), primitive.indices
        if places is None or indices is None or not len(indices) or len(indices) % 3:
            return None
        if (id(places), id(indices)) in seen:  # drawn again: the same surface
            continue
        seen.add((id(places), id(indices)))
        if not np.isfinite(places).all() or int(indices.max()) >= len(places):
            return None
        apart = level.translation - finest.translation
        with np.errstate(over="ignore"):
            positions.append((places.astype(np.float64) * level.scale + apart).astype(np.float32))
        if not np.isfinite(positions[-1]).all():
            return None
        triangles.append(indices.reshape(-1, 3).astype(np.uint32) + np.uint32(count))
        count += len(places)
    if not positions:
        return None
    return Surface(np.concatenate(positions), np.concatenate(triangles))
