"""Draws levels of detail side by side, from the decoded GLB, by a small z-buffer in numpy.

An orthographic view from above at an angle, lit by a sun and a pale sky. No artifact depends on it.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from paradize.data import Mesh
from paradize.preview.raster import covered_pixels
from paradize.preview.shade import to_light, to_srgb

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    I64 = npt.NDArray[np.int64]
    U8 = npt.NDArray[np.uint8]

SIZE = 360  # pixels a side of one level's picture
_FINE = 2 * SIZE  # pixels a side as it is drawn, before it is halved
MOST_TRIANGLES = 400_000  # of one level; more take long and look no different
_PAPER, _INK, _PALE = (24, 25, 28), (236, 236, 232), (150, 152, 156)
_SUN = np.array([-0.45, 0.75, 0.48])
_YAW, _PITCH = 0.55, 0.42  # radians


@dataclass(frozen=True)
class Skin:
    """The material of a mesh: texels (h, w, 3 or 4), linear colour and straight alpha, or one colour."""

    texels: F32 | None = None
    color: tuple[float, float, float] = (0.6, 0.58, 0.54)
    cutoff: float = 0.0


@dataclass(frozen=True)
class Shown:
    """One level: its mesh and the lines below its picture."""

    mesh: Mesh
    lines: tuple[str, ...]


def draw_levels(title: str, subtitle: str, levels: Sequence[Shown], skins: dict[str, Skin]) -> bytes:
    """A PNG of all levels, framed as the first. skins: by the groups' materials; "" for those without."""
    gap, top, below = 24, 96, 26 * max(len(level.lines) for level in levels) + 24
    width = gap + len(levels) * (SIZE + gap)
    sheet = Image.new("RGB", (max(width, 480), top + SIZE + below), _PAPER)
    pen = ImageDraw.Draw(sheet)
    pen.text((gap, 20), title, _INK, ImageFont.load_default(28))
    pen.text((gap, 58), subtitle, _PALE, ImageFont.load_default(17))
    frame = frame_of(levels[0].mesh)
    for k, level in enumerate(levels):
        x = gap + k * (SIZE + gap)
        if len(level.mesh.triangles) <= MOST_TRIANGLES:
            sheet.paste(Image.fromarray(draw_mesh(level.mesh, skins, frame)), (x, top))
        else:
            pen.text(
                (x, top + SIZE // 2), "too many triangles to draw here", _PALE, ImageFont.load_default(15)
            )
        for row, line in enumerate(level.lines):
            pen.text(
                (x, top + SIZE + 10 + 26 * row), line, _INK if row == 0 else _PALE, ImageFont.load_default(17)
            )
    out = io.BytesIO()
    sheet.save(out, "PNG", compress_level=1)
    return out.getvalue()


def axes() -> F64:
    """Rows: right, up, towards the eye."""
    cy, sy, cp, sp = np.cos(_YAW), np.sin(_YAW), np.cos(_PITCH), np.sin(_PITCH)
    right = np.array([cy, 0.0, -sy])
    back = np.array([sy * cp, sp, cy * cp])
    return np.stack([right, np.cross(back, right), back])


def frame_of(mesh: Mesh) -> tuple[F64, float]:
    """Middle of the picture (right, up) and metres a pixel."""
    seen = mesh.positions.astype(np.float64) @ axes().T
    low, high = seen.min(axis=0), seen.max(axis=0)
    return 0.5 * (low + high)[:2], max(1e-12, float((high - low)[:2].max()) / (0.94 * _FINE))


def draw_mesh(mesh: Mesh, skins: dict[str, Skin], frame: tuple[F64, float]) -> U8:
    """(SIZE, SIZE, 3) sRGB bytes."""
    middle, scale = frame
    seen = mesh.positions.astype(np.float64) @ axes().T
    x = (seen[:, 0] - middle[0]) / scale + 0.5 * _FINE - 0.5
    y = 0.5 * _FINE - (seen[:, 1] - middle[1]) / scale - 0.5
    light = np.empty((_FINE * _FINE, 3), np.float32)
    light[:] = to_light(np.array(_PAPER, np.float32) / np.float32(255))
    depth = np.full(_FINE * _FINE, -np.inf)
    runs = [(g.material, g.first, g.count) for g in mesh.groups] or [("", 0, len(mesh.triangles))]
    for material, first, count in runs:
        skin = skins.get(material) or skins.get("") or Skin()
        _draw(
            mesh,
            mesh.triangles[first : first + count],
            skin=skin,
            x=x,
            y=y,
            z=seen[:, 2],
            light=light,
            depth=depth,
        )
    fine = light.reshape(SIZE, 2, SIZE, 2, 3)
    return to_srgb(
        (fine[:, 0, :, 0] + fine[:, 0, :, 1] + fine[:, 1, :, 0] + fine[:, 1, :, 1]) * np.float32(0.25)
    )


def _draw(
    mesh: Mesh,
    triangles: npt.NDArray[np.uint32],
    skin: Skin,
    x: F64,
    y: F64,
    z: F64,
    light: F32,
    depth: F64,
) -> None:
    """Draws triangles into light (pixels, 3) and depth (pixels,)."""
    owner = np.full(depth.shape, -1)
    weights = np.empty((len(depth), 2))
    x, y, z = x[triangles.T], y[triangles.T], z[triangles.T]
    for pixels, owners, b, c in covered_pixels(x, y, (_FINE, _FINE)):
        za, zb, zc = z[:, owners]
        height = za + b * (zb - za) + c * (zc - za)
        near = height > depth[pixels]
        pixels, owners, height, bc = pixels[near], owners[near], height[near], np.stack([b, c], axis=1)[near]
        # Where several cover one pixel, the nearest is written last.
        order = np.argsort(height, kind="stable")
        if (
            skin.texels is not None
            and skin.texels.shape[2] == 4
            and skin.cutoff > 0.0
            and mesh.uvs is not None
        ):
            opaque = _texels(skin.texels, _mixed(mesh.uvs, triangles[owners], bc))[:, 3] >= skin.cutoff
            order = order[opaque[order]]
        depth[pixels[order]] = height[order]
        owner[pixels[order]] = owners[order]
        weights[pixels[order]] = bc[order]
    drawn = np.flatnonzero(owner >= 0)
    light[drawn] = _shade(mesh, triangles[owner[drawn]], weights[drawn], skin)


def _mixed(values: npt.NDArray[np.floating], corners: npt.NDArray[np.uint32], weights: F64) -> F64:
    """(n, k): the values of corners (n, 3), of which 1 and 2 have the weights (n, 2)."""
    a, b, c = (values[corner].astype(np.float64) for corner in corners.T)
    out: F64 = a + weights[:, :1] * (b - a) + weights[:, 1:] * (c - a)
    return out


def _texels(texels: F32, uvs: F64) -> F32:
    """(n, channels): the nearest texel at each of uvs (n, 2)."""
    rows, columns = texels.shape[:2]
    u, v = np.floor((uvs % 1.0) * (columns, rows)).astype(np.int64).T
    out: F32 = texels[v % rows, u % columns]
    return out


def _shade(mesh: Mesh, corners: npt.NDArray[np.uint32], weights: F64, skin: Skin) -> F32:
    """(n, 3) linear light of places in triangles, as _mixed takes them."""
    color = np.array(skin.color, np.float32)
    if skin.texels is not None and mesh.uvs is not None:
        color = _texels(skin.texels, _mixed(mesh.uvs, corners, weights))[:, :3] * color
    if mesh.colors is not None:
        color = color * _mixed(mesh.colors[:, :3], corners, weights).astype(np.float32)
    if mesh.normals is not None:
        normal = _mixed(mesh.normals, corners, weights)
    else:
        a, p, q = (mesh.positions[corner].astype(np.float64) for corner in corners.T)
        normal = np.cross(p - a, q - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    normal *= np.where(normal @ axes()[2] < 0.0, -1.0, 1.0)[:, None]  # both sides are lit alike
    sun = _SUN / np.linalg.norm(_SUN)
    lit = 1.5 * np.maximum(normal @ sun, 0.0) + 0.32 + 0.16 * normal[:, 1]
    out: F32 = color * lit[:, None].astype(np.float32)
    return out
