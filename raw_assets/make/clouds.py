"""sky/clouds.png: cumulus clouds around the horizon, small lit volumes seen from afar.

Each cloud is a box of densities: round puffs on a flat base, eroded by noise. The box is seen along one axis,
so that light and view rays are sums over its slices: light slice by slice away from its source, the view by
compositing front to back. Octaves of weaker absorption approximate multiple scattering: M. Wrenninge, C.
Kulla and V. Lundqvist, "Oz: The Great and Volumetric", 2013.

The picture holds no light of its own, because sun and moon move: red, green and blue say how bright light
from the right, the left and above makes each texel (sRGB), alpha how much of the sky it covers. It shows
PERIOD_DEG of the horizon, and its ends meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from noise import Array, lattice_noise, smoothstep, uniform
from picture import srgb_encode, write_image

BOX = (72, 192, 48)  # voxels: up, across, away
EXTINCTION = 26.0  # optical depth of a box width of full density
PIXELS = (512, 2048)
PERIOD_DEG = 120.0  # of the horizon; wider than any view, so that no cloud is seen twice
HIGH_DEG = 24.0  # elevation of the upper edge
# From where light comes, in a box's axes (up, across, away): from the right, the left, above.
LIGHTS = ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))


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
    for belt, (count, width, base, haze) in enumerate(((6, 8.0, 0.3, 0.50), (3, 13.0, 1.5, 0.16))):
        pick = uniform((count, 4), 301 + belt)
        for i, (a, b, c, d) in enumerate(pick):
            azimuth = (i + 0.75 * a) * PERIOD_DEG / count + 11.0 * belt
            size = width * (0.55 + 0.8 * b * b)
            belts.append(
                Cloud(azimuth % PERIOD_DEG, size, base + 1.1 * c, 0.30 + 0.14 * d, haze, 400 + 37 * belt + i)
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


def render(cloud: Cloud) -> Array:
    """The rendered cloud: (up, across, 4), row 0 at the base: light from the right, the left and above, all
    times the cover; the cover."""
    field = density(cloud)
    cover = 1.0 - np.exp(-EXTINCTION * field * (0.45 / BOX[2]))
    result = np.zeros((BOX[0], BOX[1], 4))
    through = np.ones(BOX[:2])
    lights = [_lit(field, sun_depth(field, np.array(light), cloud.height)) for light in LIGHTS]
    for i in range(BOX[2]):
        part = through * cover[:, :, i]
        for k, light in enumerate(lights):
            result[..., k] += part * light[:, :, i]
        result[..., 3] += part
        through = through * (1.0 - cover[:, :, i])
    rise = np.linspace(0.0, 1.0, BOX[0])[:, None, None]
    # Haze before a cloud looks like the sky behind it, so the cloud covers less.
    return np.asarray(result * (1.0 - np.clip(cloud.haze + 0.25 * (1.0 - rise) ** 2, 0.0, 1.0)))


def _lit(field: Array, depth: Array) -> Array:
    """How bright light that has passed an optical depth makes each voxel, 0..1."""
    weights = [0.46**octave for octave in range(4)]
    light = sum(weight * np.exp(-depth * 0.42**octave) for octave, weight in enumerate(weights)) / sum(
        weights
    )
    return np.asarray(light * (1.0 - 0.45 * np.exp(-7.0 * field * (0.35 + depth))))


def panorama() -> Array:
    """Light from the right, the left and above, and cover: (PIXELS, 4), row 0 at the top."""
    rows, columns = PIXELS
    azimuth = (np.arange(columns) + 0.5)[None, :] / columns * PERIOD_DEG
    elevation = (1.0 - (np.arange(rows) + 0.5)[:, None] / rows) * HIGH_DEG
    result = np.zeros((rows, columns, 4))
    for cloud in sky_of_clouds():
        picture = np.pad(render(cloud), ((1, 2), (1, 2), (0, 0)))
        turn = (azimuth - cloud.azimuth_deg + 0.5 * PERIOD_DEG) % PERIOD_DEG - 0.5 * PERIOD_DEG
        column = (turn / (2 * cloud.half_width_deg) + 0.5) * BOX[1] - 0.5 + 0.0 * elevation
        row = (
            (elevation - cloud.base_deg) / (2 * cloud.half_width_deg * cloud.height) * BOX[0]
            - 0.5
            + 0.0 * turn
        )
        inside = (column > -1) & (column < BOX[1]) & (row > -1) & (row < BOX[0])
        c, r = column[inside] + 1, row[inside] + 1
        j, i = np.floor(c).astype(np.int64), np.floor(r).astype(np.int64)
        a, b = (c - j)[:, None], (r - i)[:, None]
        low = picture[i, j] * (1 - a) + picture[i, j + 1] * a
        high = picture[i + 1, j] * (1 - a) + picture[i + 1, j + 1] * a
        seen = low * (1 - b) + high * b
        result[inside] = result[inside] * (1 - seen[:, 3:]) + seen
    return result


def make(out: Path) -> None:
    """Writes the picture under out/sky."""
    light = panorama()
    cover = light[..., 3:]
    color = np.where(cover > 1e-4, light[..., :3] / np.maximum(cover, 1e-4), 0.5)
    write_image(out / "sky/clouds.png", np.concatenate([srgb_encode(color), cover], -1), "uint8")
