"""Cumulus clouds over the horizon: small lit volumes, seen from afar.

Each cloud is a box of densities: round puffs on a flat base, eroded by noise. The box is seen along one axis,
so that light and view rays are sums over its slices: sunlight slice by slice away from the sun, the view by
compositing front to back. Octaves of weaker absorption approximate multiple scattering: M. Wrenninge, C.
Kulla and V. Lundqvist, "Oz: The Great and Volumetric", 2013. The phase function gives the bright rim towards
the sun.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from noise import Array, lattice_noise, smoothstep, uniform

BOX = (72, 192, 48)  # voxels: up, across, away
EXTINCTION = 26.0  # optical depth of a box width of full density
SUNLIGHT = np.array([3.2, 2.52, 1.80])
SHADE_LOW, SHADE_HIGH = (
    np.array([0.30, 0.34, 0.43]),
    np.array([0.36, 0.46, 0.66]),
)  # light from sea and from sky
HAZE = np.array([0.93, 0.83, 0.75])


@dataclass(frozen=True)
class Cloud:
    """A cloud: bearing and half width in degrees, base, aspect, share of haze, seed."""

    azimuth_deg: float
    half_width_deg: float
    base_deg: float
    height: float  # height of the box as a share of its width
    haze: float
    seed: int


def sky_of_clouds() -> list[Cloud]:
    """The clouds, farthest first: two uneven belts along the horizon."""
    belts = []
    for belt, (count, width, base, haze) in enumerate(((17, 9.0, 0.3, 0.50), (13, 15.0, 1.5, 0.16))):
        pick = uniform((count, 4), 301 + belt)
        for i, (a, b, c, d) in enumerate(pick):
            azimuth = (i + 0.75 * a) * 360.0 / count + 11.0 * belt
            size = width * (0.55 + 0.8 * b * b)
            belts.append(
                Cloud(azimuth % 360.0, size, base + 1.1 * c, 0.30 + 0.14 * d, haze, 400 + 37 * belt + i)
            )
    return belts


def density(cloud: Cloud) -> Array:
    """Density 0..1 of a cloud's box: (up, across, away)."""
    ny, nx, nz = BOX
    y = (np.arange(ny) + 0.5)[:, None, None] / ny * cloud.height
    x = ((np.arange(nx) + 0.5) / nx - 0.5)[None, :, None]
    z = ((np.arange(nz) + 0.5) / nz - 0.5)[None, None, :] * 0.45
    pick = uniform((26, 4), cloud.seed)
    field = np.full(BOX, -1.0)
    for a, b, c, d in pick:
        across = (a + pick[int(26 * b), 0]) * 0.5 - 0.5  # mean of two numbers: denser in the middle
        reach = 1.0 - (abs(across) / 0.5) ** 1.5
        radius = (0.035 + 0.075 * d) * (0.45 + 0.65 * reach)
        lift = 0.20 * cloud.height + (cloud.height * 0.62 - radius) * c * reach * (0.35 + 0.65 * d)
        deep = (b - 0.5) * 0.22
        away = np.sqrt(((x - across * 0.82) / 1.12) ** 2 + (y - lift) ** 2 + (z - deep) ** 2)
        field = np.maximum(field, 1.0 - away / radius)
    cells = (9, 24, 6)
    billow = np.zeros(BOX)
    for octave, weight in enumerate((0.52, 0.34, 0.22, 0.12)):
        scale = 2**octave
        finer = tuple(min(c * scale, n // 2) for c, n in zip(cells, BOX, strict=True))
        billow += weight * (np.abs(lattice_noise(BOX, finer, cloud.seed + 7 * octave, wrap=False)) - 0.8)
    base = smoothstep(0.085, 0.16, y / cloud.height + 0.02 * billow)
    return np.asarray(smoothstep(-0.10, 0.42, field + 0.55 * billow) * smoothstep(-0.9, -0.25, field) * base)


def _shifted(plane: Array, rows: float, columns: float) -> Array:
    """A plane shifted by a fraction of pixels, bilinear; zeros outside."""
    for axis, amount in ((0, rows), (1, columns)):
        whole = int(np.floor(amount))
        part = amount - whole
        wide = np.pad(plane, [(abs(whole) + 1,) * 2 if a == axis else (0, 0) for a in (0, 1)])
        start, length = abs(whole) + 1 - whole, plane.shape[axis]
        near = np.take(wide, range(start, start + length), axis)
        far = np.take(wide, range(start - 1, start - 1 + length), axis)
        plane = near * (1.0 - part) + far * part
    return plane


def sun_depth(field: Array, sun: Array, height: float) -> Array:
    """Optical depth from each voxel to the sun, whose direction is in the box's axes (up, across, away)."""
    voxel = np.array([height / BOX[0], 1.0 / BOX[1], 0.45 / BOX[2]])
    steps = sun / voxel  # voxels per box width travelled
    axis = int(np.argmax(np.abs(steps)))
    moved = np.moveaxis(field, axis, 0)
    order = range(moved.shape[0] - 1, -1, -1) if steps[axis] > 0 else range(moved.shape[0])
    rest = [a for a in range(3) if a != axis]
    rows, columns = (-steps[a] / abs(steps[axis]) for a in rest)
    travelled = EXTINCTION / abs(steps[axis])
    depth, plane = np.zeros_like(moved), np.zeros(moved.shape[1:])
    for i in order:
        depth[i] = plane + 0.5 * travelled * moved[i]
        plane = _shifted(plane + travelled * moved[i], rows, columns)
    return np.moveaxis(depth, 0, axis)


def render(cloud: Cloud, sun: Array) -> Array:
    """The rendered cloud: (up, across, 4), row 0 at the base, premultiplied radiance and opacity."""
    azimuth = np.radians(cloud.azimuth_deg)
    right = np.array([np.cos(azimuth), 0.0, np.sin(azimuth)])
    away = np.array([np.sin(azimuth), 0.0, -np.cos(azimuth)])
    local = np.array([sun[1], right @ sun, away @ sun])
    field = density(cloud)
    depth = sun_depth(field, local, cloud.height)
    cosine = float(away @ sun)
    light = np.zeros(BOX)
    for octave in range(4):
        fade = 0.42**octave
        g = 0.75 * 0.55**octave
        lobe = (1 - g * g) / (1 + g * g - 2 * g * cosine) ** 1.5
        back = (1 - 0.09) / (1 + 0.09 + 0.6 * cosine) ** 1.5
        light += 0.46**octave * (0.55 * lobe + 0.45 * back) * np.exp(-depth * fade)
    powder = 1.0 - 0.45 * np.exp(-7.0 * field * (0.35 + depth))
    light *= 0.40 * powder
    heights = np.linspace(0.0, 1.0, BOX[0])[:, None, None]
    cover = 1.0 - np.exp(-EXTINCTION * field * (0.45 / BOX[2]))
    result, through = np.zeros((BOX[0], BOX[1], 4)), np.ones(BOX[:2])
    for i in range(BOX[2]):
        part = (through * cover[:, :, i])[..., None]
        ambient = SHADE_LOW + (SHADE_HIGH - SHADE_LOW) * smoothstep(0.1, 0.9, heights[:, :, 0])[..., None]
        result[..., :3] += part * (SUNLIGHT * light[:, :, i, None] + ambient * 0.72)
        result[..., 3:] += part
        through = through * (1.0 - cover[:, :, i])
    rise = np.linspace(0.0, 1.0, BOX[0])[:, None, None]
    haze = np.clip(cloud.haze + 0.25 * (1.0 - rise) ** 2, 0.0, 1.0)
    result[..., :3] += (HAZE * result[..., 3:] - result[..., :3]) * haze
    return result


@cache
def _pictures(sun: tuple[float, float, float]) -> list[tuple[Cloud, Array]]:
    return [(cloud, render(cloud, np.array(sun))) for cloud in sky_of_clouds()]


def over(direction: Array, sky: Array, sun: Array) -> Array:
    """Composites the clouds over the sky; direction, sky : (..., 3)."""
    azimuth = np.degrees(np.arctan2(direction[..., 0], -direction[..., 2]))
    elevation = np.degrees(np.arcsin(np.clip(direction[..., 1], -1.0, 1.0)))
    result = sky.copy()
    for cloud, picture in _pictures((float(sun[0]), float(sun[1]), float(sun[2]))):
        turn = (azimuth - cloud.azimuth_deg + 180.0) % 360.0 - 180.0
        column = (turn / (2 * cloud.half_width_deg) + 0.5) * BOX[1] - 0.5
        row = (elevation - cloud.base_deg) / (2 * cloud.half_width_deg * cloud.height) * BOX[0] - 0.5
        inside = (column > -1) & (column < BOX[1]) & (row > -1) & (row < BOX[0])
        if not inside.any():
            continue
        c, r = column[inside] + 1, row[inside] + 1
        wide = np.pad(picture, ((1, 2), (1, 2), (0, 0)))
        j, i = np.floor(c).astype(np.int64), np.floor(r).astype(np.int64)
        a, b = (c - j)[:, None], (r - i)[:, None]
        low = wide[i, j] * (1 - a) + wide[i, j + 1] * a
        high = wide[i + 1, j] * (1 - a) + wide[i + 1, j + 1] * a
        seen = low * (1 - b) + high * b
        result[inside] = result[inside] * (1 - seen[:, 3:]) + seen[:, :3]
    return result
