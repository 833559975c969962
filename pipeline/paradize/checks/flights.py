"""Rules for the camera path: it stays above the terrain, and surfaces stay beyond the near plane."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt, tan
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.checks.rules import Finding
from paradize.errors import ParadizeError
from paradize.formats.glb.reader import decode_glb
from paradize.formats.glb.tiles import decode_tile
from paradize.formats.scene.manifest import read_entry
from paradize.placement import largest_scale, turned_back
from paradize.scene.flight import Flight
from paradize.scene.motion import moved, reach_m

F64 = npt.NDArray[np.float64]

_STEP_S = 0.05
_RUN = 32  # moments in a batch


def check_flight(manifest: dict[str, Any], folder: Path, file: str) -> Iterator[Finding]:
    """The findings along the path of a manifest. Another rule reports files that cannot be read."""
    path = manifest["flight"]
    flight = Flight.from_json(path)
    count = max(2, round(path["duration_s"] / _STEP_S))
    moments = [path["duration_s"] * k / count for k in range(count)]
    eyes = np.array([flight.view(moment)[0] for moment in moments])
    width, height = manifest["viewport"]
    slope = tan(0.5 * path["fov_rad"])
    near = path["near_m"] * sqrt(1.0 + slope * slope * (1.0 + (width / height) ** 2))
    above = _above_ground(manifest, folder, eyes)
    apart = _nearest_object(manifest, folder, eyes, near)
    under = np.flatnonzero(above < 0.0)
    if len(under):
        worst = under[above[under].argmin()]
        what = f"the eye is {-above[worst]:.3g} m under ground"
        yield Finding("PZ411", file, what, _place(moments[worst], eyes[worst]), len(under))
    for what, distance in (("ground", np.where(above < 0.0, np.inf, above)), ("objects", apart)):
        close = np.flatnonzero(distance < near)
        if len(close):
            worst = close[distance[close].argmin()]
            words = f"{what} within {distance[worst]:.3g} m of the eye; the near plane reaches {near:.3g} m"
            yield Finding("PZ412", file, words, _place(moments[worst], eyes[worst]), len(close))


def _place(moment: float, eye: F64) -> str:
    return f"flight at {moment:.2f} s, ({', '.join(f'{x:.4g}' for x in eye)})"


def _above_ground(manifest: dict[str, Any], folder: Path, eyes: F64) -> F64:
    """(n,) metres of each eye above the finest patches of the terrain; infinite without terrain."""
    above = np.full(len(eyes), np.inf)
    terrain = manifest["terrain"]
    if terrain is None:
        return above
    for name in terrain["tiles"]:
        try:
            tile = decode_tile(read_entry(folder, manifest["artifacts"][name]), name)
        except (OSError, ParadizeError):
            continue
        for patch in tile:
            if not patch.finest:
                continue
            points = patch.mesh.positions.astype(np.float64)
            low, high = points.min(axis=0), points.max(axis=0)
            here = np.flatnonzero(((eyes >= low) & (eyes <= high))[:, [0, 2]].all(axis=1))
            for part in np.array_split(here, max(1, len(here) // _RUN)):
                if len(part):
                    heights = heights_at(points, patch.mesh.triangles, eyes[part][:, [0, 2]])
                    above[part] = np.fmin(above[part], eyes[part, 1] - heights)
    return above


def heights_at(points: F64, triangles: npt.NDArray[np.uint32], places: F64) -> F64:
    """(n,) heights of a surface at positions (n, 2), x and z; NaN beside it."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    (ux, uz), (vx, vz) = ((side[:, [0, 2]] - a[:, [0, 2]]).T for side in (b, c))
    area = ux * vz - uz * vx
    with np.errstate(divide="ignore", invalid="ignore"):
        x, z = (places[:, None, k] - a[None, :, 2 * k] for k in range(2))
        v, w = (x * vz - z * vx) / area, (z * ux - x * uz) / area
        inside = (v >= -1e-9) & (w >= -1e-9) & (v + w <= 1.0 + 1e-9)
        heights = np.where(inside, a[:, 1] + v * (b - a)[:, 1] + w * (c - a)[:, 1], -np.inf)
    highest = heights.max(axis=1, initial=-np.inf)
    return np.asarray(np.where(np.isfinite(highest), highest, np.nan))


def _nearest_object(manifest: dict[str, Any], folder: Path, eyes: F64, reach: float) -> F64:
    """(n,) metres from each eye to the finest level of the nearest object; infinite beyond `reach`."""
    nearest = np.full(len(eyes), np.inf)
    corners, last = np.zeros((0, 3, 3)), ""
    for item in sorted(manifest["objects"], key=lambda item: str(item["mesh"])):
        if item["mesh"] != last:
            last = item["mesh"]
            try:
                mesh = decode_glb(read_entry(folder, manifest["artifacts"][last]), last)[0].mesh
                corners = mesh.absolute_positions[mesh.triangles]
            except (OSError, ParadizeError):
                corners = np.zeros((0, 3, 3))
        if not len(corners):
            continue
        if item["motion"] is not None:
            nearest = np.minimum(nearest, _nearest_moving(item, corners, eyes, reach))
            continue
        ends = np.stack([corners.min(axis=(0, 1)), corners.max(axis=(0, 1))])
        for instance in item["instances"]:
            x, y, z = (eyes - np.array(instance["position"])).T
            own = np.stack(turned_back((x, y, z), instance["rotation"]), axis=1)
            box = ends * instance["scale"]
            if ((own < box.min(axis=0) - reach) | (own > box.max(axis=0) + reach)).any(axis=1).all():
                continue
            sized = corners * instance["scale"]
            low, high = sized.min(axis=1), sized.max(axis=1)
            for first in range(0, len(own), _RUN):
                run = own[first : first + _RUN]
                near = ((low <= run.max(axis=0) + reach) & (high >= run.min(axis=0) - reach)).all(axis=1)
                if near.any():
                    here = slice(first, first + len(run))
                    nearest[here] = np.minimum(nearest[here], distances(run, sized[near]))
    return np.asarray(np.where(nearest < reach, nearest, np.inf))


def _nearest_moving(item: dict[str, Any], corners: F64, eyes: F64, reach: float) -> F64:
    """The distances (n,) of the eyes from an object that moves, each from where it is then, its wings and
    legs at rest."""
    nearest = np.full(len(eyes), np.inf)
    farthest = float(np.sqrt((corners * corners).sum(axis=2)).max())
    for k, instance in enumerate(item["instances"]):
        away = eyes - np.array(instance["position"])
        limit = reach_m(item["motion"]) + largest_scale(instance) * farthest + reach
        for i in np.flatnonzero((away * away).sum(axis=1) < limit * limit).tolist():
            now = moved(instance, item["motion"], k, i / len(eyes))
            eye = (eyes[i] - now["position"]).tolist()
            own = np.array([turned_back(eye, now["rotation"])])
            nearest[i] = min(nearest[i], float(distances(own, corners * now["scale"])[0]))
    return nearest


def distances(places: F64, corners: F64) -> F64:
    """(n,) distance of each place (n, 3) to the nearest of the triangles (m, 3, 3): to the foot of the
    perpendicular if it lies inside, else to the nearest side. Source: C. Ericson, "Real-Time Collision
    Detection", 2005."""
    best = np.full(len(places), np.inf)
    for first in range(0, len(corners), 4096):
        a, b, c = corners[first : first + 4096].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        square = (normal * normal).sum(axis=1)
        away = places[:, None, :] - a
        inside = square > 0.0
        for start, end in ((a, b), (b, c), (c, a)):
            within = np.cross(end - start, places[:, None, :] - start)
            inside = inside & (np.einsum("ijk,jk->ij", within, normal) >= 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            upright = np.abs(np.einsum("ijk,jk->ij", away, normal)) / np.sqrt(square)
        nearest = np.where(inside, upright, np.inf)
        for start, end in ((a, b), (b, c), (c, a)):
            side = end - start
            length = (side * side).sum(axis=1)
            along = np.einsum("ijk,jk->ij", places[:, None, :] - start, side)
            share = np.clip(np.divide(along, length, out=np.zeros_like(along), where=length > 0.0), 0.0, 1.0)
            gap = places[:, None, :] - (start + share[:, :, None] * side)
            nearest = np.minimum(nearest, np.sqrt(np.einsum("ijk,ijk->ij", gap, gap)))
        best = np.minimum(best, nearest.min(axis=1))
    return best
