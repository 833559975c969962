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
from paradize.player_limits import DEPTH_RANGE
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
            fits = 0.9 * path["near_m"] * distance[worst] / near
            mend = "move the waypoints of that second away"
            mend += f", or write near_m = {fits:.2g}" if fits * DEPTH_RANGE > path["far_m"] else ""
            yield Finding("PZ412", file, words, _place(moments[worst], eyes[worst]), len(close), mend)


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
        boxes = np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1)
        for k, instance in enumerate(item["instances"]):
            if item["motion"] is None:
                here = np.arange(len(eyes))
                x, y, z = (eyes - np.array(instance["position"])).T
                own = np.stack(turned_back((x, y, z), instance["rotation"]), axis=1)
            else:
                here, own = _beside_moving(item["motion"], instance, k, corners, eyes, reach)
            apart = _nearest_triangle(own, corners, boxes, np.array(instance["scale"]), reach)
            nearest[here] = np.minimum(nearest[here], apart)
    return np.asarray(np.where(nearest < reach, nearest, np.inf))


def _beside_moving(
    motion: dict[str, Any], instance: dict[str, Any], index: int, corners: F64, eyes: F64, reach: float
) -> tuple[npt.NDArray[np.intp], F64]:
    """The moments at which an instance that moves may be within reach, and the eyes (n, 3) as seen from where
    it is then, its wings and legs at rest."""
    farthest = float(np.sqrt((corners * corners).sum(axis=2)).max())
    limit = reach_m(motion) + largest_scale(instance) * farthest + reach
    away = eyes - np.array(instance["position"])
    here = np.flatnonzero((away * away).sum(axis=1) < limit * limit)
    own = np.empty((len(here), 3))
    for row, i in enumerate(here.tolist()):
        now = moved(instance, motion, index, i / len(eyes))
        own[row] = turned_back((eyes[i] - now["position"]).tolist(), now["rotation"])
    return here, own


def _nearest_triangle(places: F64, corners: F64, boxes: F64, scale: F64, reach: float) -> F64:
    """(n,) distance of each place (n, 3) to the nearest of the triangles (m, 3, 3) in boxes (m, 2, 3), which
    are scaled first; where that is beyond `reach`, any distance beyond it."""
    nearest = np.full(len(places), np.inf)
    whole = np.sort(np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]) * scale, axis=0)
    here = np.flatnonzero(((places >= whole[0] - reach) & (places <= whole[1] + reach)).all(axis=1))
    if len(here):
        low, high = np.sort(boxes * scale, axis=1).transpose(1, 0, 2)
        for run in np.array_split(here, -(-len(here) // _RUN)):
            eyes = places[run]
            near = ((low <= eyes.max(axis=0) + reach) & (high >= eyes.min(axis=0) - reach)).all(axis=1)
            if near.any():
                nearest[run] = distances(eyes, corners[near] * scale)
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
