"""A lit preview of a material: a sphere for a tiling map, else the whole map from above.

Uses the decoded artifacts only, so errors of block compression are visible as in the player. Light and
reflection follow shaders/lib/brdf.glsl: GGX of B. Walter et al., "Microfacet Models for Refraction through
Rough Surfaces", EGSR 2007, with alpha = (1 - smoothness)^2 and a reflectance of 0.08 times the specular
intensity at normal incidence.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]

_LIGHT = np.array([-0.55, 0.62, 0.56], np.float32) / np.float32(np.sqrt(0.55**2 + 0.62**2 + 0.56**2))
_SUN = np.array([3.3, 3.05, 2.7], np.float32)  # radiance times pi at normal incidence
_SKY = np.array([0.30, 0.36, 0.45], np.float32)  # from above
_GROUND = np.array([0.13, 0.11, 0.09], np.float32)  # from below
_PAPER = np.array([0.0091, 0.0097, 0.0116], np.float32)  # background of the sphere
_REPEATS = 2.0  # repetitions of a tiling map over the visible half of the sphere


@dataclass(frozen=True)
class Material:
    """The maps to light. color: (h, w, 3) linear 0..1. alpha: (h, w). normal: (h, w, 3) unit, tangent space.
    specular, smoothness: (h, w), 0..1. All may differ in size; None: the base values."""

    color: F32 | None = None
    alpha: F32 | None = None
    normal: F32 | None = None
    specular: F32 | None = None
    smoothness: F32 | None = None
    base: tuple[float, float, float] = (0.5, 0.5, 0.5)
    base_specular: float = 0.5
    base_smoothness: float = 0.5


def to_srgb(linear: F32) -> npt.NDArray[np.uint8]:
    """Converts linear light (..., 3) to sRGB bytes; values above 1 are clipped."""
    v = np.clip(linear, 0.0, 1.0)
    encoded = np.where(v <= 0.0031308, v * 12.92, 1.055 * np.power(v, 1 / 2.4) - 0.055)
    return np.rint(encoded * 255.0).astype(np.uint8)


def to_light(encoded: F32) -> F32:
    """Converts sRGB-encoded values 0..1 to linear light."""
    light = np.where(encoded <= 0.04045, encoded / 12.92, np.power((encoded + 0.055) / 1.055, 2.4))
    return light.astype(np.float32)


def _sample(texels: F32, u: F32, v: F32) -> F32:
    """Bilinear samples of a repeating texture. u, v: in repetitions, v down the image."""
    rows, columns = texels.shape[:2]
    x, y = u * np.float32(columns) - np.float32(0.5), v * np.float32(rows) - np.float32(0.5)
    left, top = np.floor(x), np.floor(y)
    fx, fy = x - left, y - top
    if texels.ndim == 3:
        fx, fy = fx[..., None], fy[..., None]
    i0, j0 = left.astype(np.int64) % columns, top.astype(np.int64) % rows
    i1, j1 = (i0 + 1) % columns, (j0 + 1) % rows
    flat = texels.reshape(rows * columns, *texels.shape[2:])
    a, b, c, d = (flat.take(j * columns + i, axis=0) for j in (j0, j1) for i in (i0, i1))
    upper, lower = a * (1 - fx) + b * fx, c * (1 - fx) + d * fx
    out: F32 = upper * (1 - fy) + lower * fy
    return out


def _unit(vectors: F32) -> F32:
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    out: F32 = vectors / np.maximum(length, np.float32(1e-6))
    return out


def _lit(material: Material, u: F32, v: F32, frame: tuple[F32, F32, F32]) -> F32:
    """Linear radiance (h, w, 3) towards a distant eye at +Z. frame: T, B, N of each pixel."""
    shape = u.shape
    color = np.broadcast_to(np.asarray(material.base, np.float32), (*shape, 3))
    if material.color is not None:
        color = _sample(material.color, u, v)
    normal = frame[2]
    if material.normal is not None:
        relief = _sample(material.normal, u, v)
        normal = _unit(relief[..., :1] * frame[0] + relief[..., 1:2] * frame[1] + relief[..., 2:] * frame[2])
    specular = np.float32(material.base_specular)
    f0 = 0.08 * (_sample(material.specular, u, v) if material.specular is not None else specular)
    smooth = np.full(shape, material.base_smoothness, np.float32)
    if material.smoothness is not None:
        smooth = _sample(material.smoothness, u, v)
    alpha = np.maximum((1.0 - np.clip(smooth, 0, 1)) ** 2, 0.02)

    n_l = np.clip((normal * _LIGHT).sum(axis=-1), 0.0, 1.0)
    n_v = np.clip(normal[..., 2], 1e-3, 1.0)
    half = _LIGHT + np.array([0, 0, 1], np.float32)
    half /= np.sqrt((half * half).sum())
    n_h = np.clip((normal * half).sum(axis=-1), 0.0, 1.0)
    a2 = alpha * alpha
    d = n_h * n_h * (a2 - 1.0) + 1.0
    smith = 2.0 * n_l * n_v * (1.0 - alpha) + (n_l + n_v) * alpha
    fresnel = f0 + (1.0 - f0) * (1.0 - half[2]) ** 5 * np.minimum(1.0, 50.0 * f0)
    mirror = np.minimum(a2 / np.maximum(d * d, 1e-8) * 0.5 / np.maximum(smith, 1e-4) * fresnel * n_l, 40.0)
    up = 0.5 + 0.5 * normal[..., 1:2]
    around = _GROUND + (_SKY - _GROUND) * up
    reflected = 0.5 + 0.5 * (2.0 * n_v * normal[..., 1])[..., None]
    bounce = f0 + (1.0 - f0) * (1.0 - n_v) ** 5 * np.minimum(1.0, 50.0 * f0) * (1.0 - alpha)
    sky = (_GROUND + (_SKY - _GROUND) * reflected) * bounce[..., None]
    lit: F32 = color * (around + _SUN * n_l[..., None] / 3.3) + _SUN * mirror[..., None] / 3.3 + sky
    return lit.astype(np.float32)


def _checkerboard(width: int, height: int) -> F32:
    """A dark checkerboard, linear, visible through transparent texels."""
    y, x = np.mgrid[0:height, 0:width] // 16
    shade = np.where((x + y) % 2 == 0, 0.035, 0.055).astype(np.float32)
    return np.repeat(shade[..., None], 3, axis=2)


def flat_preview(material: Material, width: int, height: int) -> npt.NDArray[np.uint8]:
    """The whole map over width x height pixels, sRGB bytes."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    u, v = (x + np.float32(0.5)) / np.float32(width), (y + np.float32(0.5)) / np.float32(height)
    frame = tuple(np.broadcast_to(np.eye(3, dtype=np.float32)[k], (height, width, 3)) for k in range(3))
    lit = _lit(material, u, v, (frame[0], frame[1], frame[2]))
    if material.alpha is not None:
        cover = np.clip(_sample(material.alpha, u, v), 0, 1)[..., None]
        lit = lit * cover + _checkerboard(width, height) * (1 - cover)
    return to_srgb(lit)


def sphere_preview(material: Material, size: int) -> npt.NDArray[np.uint8]:
    """A sphere with two repetitions of the map across, size x size pixels, sRGB bytes."""
    radius = 0.47 * size
    y, x = np.mgrid[0:size, 0:size].astype(np.float32)
    x, y = (x + 0.5 - size / 2) / radius, (size / 2 - y - 0.5) / radius
    reach = np.sqrt(x * x + y * y)
    shrink = np.minimum(1.0, 0.9999 / np.maximum(reach, 1e-6)).astype(np.float32)
    nx, ny = x * shrink, y * shrink
    nz = np.sqrt(np.maximum(0.0, 1.0 - nx * nx - ny * ny))
    around, above = np.arctan2(nx, nz), np.arcsin(np.clip(ny, -1, 1))
    u = (around / np.pi * _REPEATS).astype(np.float32)
    v = (0.5 - above / np.pi * _REPEATS).astype(np.float32)
    zero = np.zeros_like(nx)
    tangent = np.stack([np.cos(around), zero, -np.sin(around)], axis=-1).astype(np.float32)
    normal = np.stack([nx, ny, nz], axis=-1).astype(np.float32)
    lit = _lit(material, u, v, (tangent, np.cross(normal, tangent).astype(np.float32), normal))
    cover = np.clip((1.0 - reach) * radius + 0.5, 0.0, 1.0)[..., None]
    if material.alpha is not None:
        cover = cover * np.clip(_sample(material.alpha, u, v), 0, 1)[..., None]
    return to_srgb(lit * cover + _PAPER * (1 - cover))
