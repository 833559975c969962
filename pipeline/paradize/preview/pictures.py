"""Pictures for contact sheets: each map as the hardware reads it, as 8-bit values, and the lit material."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from paradize.map_table import MAPS
from paradize.metrics.texels import decode_texels
from paradize.preview.shade import Material, flat_preview, sphere_preview, to_light

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Texture

    F32 = npt.NDArray[np.float32]
    U8 = npt.NDArray[np.uint8]

MAX_SHOWN = 1024  # texels per side of the shown mip; the close view shows level 0


@dataclass(frozen=True)
class SheetMap:
    """A map of a material. tier, errors (metric -> value) and levels (a dict of errors per level) as
    measured. bytes: size of its file."""

    texture: Texture
    bytes: int
    tier: str
    errors: dict[str, float]
    levels: list[dict[str, float]] = field(default_factory=list)


@dataclass(frozen=True)
class MaterialDefaults:
    """Values of a material without maps. tiles: whether it repeats; then it is shown on a sphere. about: the
    meaning of its colours where they are data."""

    tiles: bool = False
    color: tuple[float, float, float] = (0.5, 0.5, 0.5)
    specular: float = 0.5
    smoothness: float = 0.5
    about: str = ""


def shown_level(texture: Texture, largest: int) -> int:
    """The finest level of at most `largest` texels per side."""
    level = 0
    while max(texture.width, texture.height) >> level > largest and level + 1 < len(texture.levels):
        level += 1
    return level


def rebuilt(xy: F32) -> F32:
    """Unit normals (h, w, 3) from x and y."""
    z = np.sqrt(np.maximum(0.0, 1.0 - (xy * xy).sum(axis=2, keepdims=True)))
    out = np.concatenate([xy, z], axis=2)
    length = np.sqrt((out * out).sum(axis=2, keepdims=True))
    unit: F32 = (out / np.maximum(length, 1e-6)).astype(np.float32)
    return unit


def to_bytes(values: F32) -> U8:
    texels: U8 = np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8)
    return texels


def _grey(values: F32) -> U8:
    codes = to_bytes(values)
    return np.repeat(codes[:, :, None], 3, axis=2)


def picture_of(name: str, decoded: F32, channel: int | None = None) -> U8:
    """A map as a picture: colour and grey unchanged, signed values with zero at mid-grey."""
    kind = MAPS[name].kind
    if channel is not None or kind == "value":
        return _grey(decoded[:, :, channel or 0])
    if kind == "color":
        return to_bytes(decoded[:, :, :3])
    if kind == "normal":
        return to_bytes(rebuilt(decoded[:, :, :2]) * 0.5 + 0.5)
    largest = max(1e-6, float(np.abs(decoded[:, :, :2]).max()))
    signed = decoded[:, :, :2] / largest * 0.5 + 0.5
    return to_bytes(np.dstack([signed, np.full(signed.shape[:2], 0.5, np.float32)]))


def has_holes(texture: Texture) -> bool:
    """Whether any texel of a colour map is transparent."""
    decoded = decode_texels(texture, shown_level(texture, 256))
    return decoded.shape[2] == 4 and float(decoded[:, :, 3].min()) < 1.0


def close_view(texture: Texture, size: int) -> F32:
    """At most `size` x `size` texels from the centre of level 0."""
    rows, columns = min(size, texture.height), min(size, texture.width)
    edge = 4 if texture.format.startswith("BC") else 1
    top = (texture.height - rows) // 2 // edge * edge
    per_row = len(texture.levels[0]) // -(-texture.height // edge)
    bands = -(-rows // edge)
    band = texture.levels[0][top // edge * per_row : (top // edge + bands) * per_row]
    part = type(texture)(texture.format, texture.width, min(bands * edge, texture.height - top), (band,))
    left = (texture.width - columns) // 2
    return decode_texels(part)[:rows, left : left + columns]


def lit_preview(maps: dict[str, SheetMap], defaults: MaterialDefaults, size: int) -> U8:
    """The material, lit, from its decoded maps: sRGB uint8, at most (size, size, 3)."""
    decoded = {
        name: decode_texels(entry.texture, shown_level(entry.texture, MAX_SHOWN))
        for name, entry in maps.items()
        if name in ("color", "normal", "gloss")
    }
    color, gloss = decoded.get("color"), decoded.get("gloss")
    srgb = color is not None and maps["color"].texture.format.endswith("_SRGB")
    material = Material(
        color=None if color is None else to_light(color[:, :, :3]) if srgb else color[:, :, :3],
        alpha=None if color is None or color.shape[2] < 4 else np.ascontiguousarray(color[:, :, 3]),
        normal=rebuilt(decoded["normal"][:, :, :2]) if "normal" in decoded else None,
        specular=None if gloss is None else np.ascontiguousarray(gloss[:, :, 0]),
        smoothness=None if gloss is None else np.ascontiguousarray(gloss[:, :, 1]),
        base=defaults.color,
        base_specular=defaults.specular,
        base_smoothness=defaults.smoothness,
    )
    if defaults.tiles:
        return sphere_preview(material, size)
    texture = next(iter(maps.values())).texture
    longest = max(texture.width, texture.height)
    return flat_preview(
        material, max(1, size * texture.width // longest), max(1, size * texture.height // longest)
    )
