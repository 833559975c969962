"""A material as a model's file describes it, whatever the format: colours, factors and the pictures of its
maps.

Readers (OBJ's MTL, glTF) fill it, a scene's `[object.material.NAME]` may replace fields of it, and the bake
makes textures of it. The model of light is glTF's: The Khronos Group, "glTF 2.0 Specification", 2021,
appendix B.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

AlphaMode = Literal["opaque", "mask", "blend"]
Channel = Literal["rgb", "r", "g", "b", "a", "luminance"]
Wrap = Literal["clamp", "repeat", "mirror"]
WRAPS: tuple[Wrap, ...] = ("repeat", "clamp", "mirror")
# How much wider than a tile UVs may be, in tiles, that still give each texel a place of its own: the few that
# two triangles show hold the mean of both.
OVERHANG = 0.1
REPEATED: tuple[Wrap, Wrap] = ("repeat", "repeat")
# (scale, offset) along u and v, of one tile of texture coordinates.
Placed = tuple[tuple[float, float], tuple[float, float]]
PLASTIC_REFLECTANCE = 0.04  # at normal incidence: what Material.specular = 1 stands for
MAX_EMISSION = 1e7  # what the player takes
MAX_NORMAL_SCALE = 1e6
MAX_BUMP_M = 1e6
# Maps that may lie on second texture coordinates: none decides what is cut out.
SECOND_ROLES = ("normal", "roughness", "smoothness", "metalness", "emission", "occlusion")


@dataclass(frozen=True)
class Picture:
    """A picture that a model names: a file, or bytes inside the model's own file.

    file: of the picture; of the model where the picture is inside it. data: the picture's bytes (PNG, JPEG
    ...) where it is inside the model's file, else None. name: for messages. model: the file that the picture
    was taken out of, where `file` is a copy in the store.
    """

    file: Path
    data: bytes | None = None
    name: str = ""
    model: Path | None = None


@dataclass(frozen=True)
class MapSource:
    """The picture of one map and how it is read.

    channel: which values count. wrap: what lies beyond the edges along u and v; None: the format does not
    say. nearest: whether texels look like squares where they are enlarged. inverted: the value counts as 1 -
    value. srgb: whether its colours are sRGB, whatever the picture says of them. Offsets, scales and turns of
    texture coordinates are no field: readers apply them to the mesh. Only where the mesh cannot hold them
    too, `placed` says how the picture has to be drawn anew for the material's coordinates: its own are
    scale * t + offset of theirs.
    """

    picture: Picture
    channel: Channel = "rgb"
    wrap: tuple[Wrap, Wrap] | None = None
    nearest: bool = False
    inverted: bool = False
    srgb: bool = False
    placed: Placed | None = None


@dataclass(frozen=True)
class Reflected:
    """The colour of what is reflected, in a model of light without metalness. color: linear RGB, multiplies
    the picture's, which is sRGB and lies where the material's colour does."""

    source: MapSource
    color: tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """A material. Factors multiply what their maps hold; without a map they stand alone.

    color: linear RGB, 0..1, opacity: 0..1. alpha_mode: None where the file does not say. alpha_cutoff: of
    "mask". roughness, metalness: 0..1; None where the file does not say. A map of smoothness is first turned
    into roughness, which `roughness` multiplies; the smoothness of that, `smoothness` does (0..1). specular:
    intensity of the reflection of what is not a metal, 1: 4 % at normal incidence. emission: linear RGB, 0
    to MAX_EMISSION. normal_scale: multiplies x and y of the normal map, up to +-MAX_NORMAL_SCALE. green_down:
    whether the normal map's green points down; None where the file does not say. occlusion_strength: 0..1.
    bump_m: height of full white of `height`, metres, up to MAX_BUMP_M; None where the file does not say.

    maps: by role. Roles: "color" and "emission" (sRGB), "alpha", "normal", "height", "roughness",
    "smoothness", "specular", "metalness", "occlusion". second: the roles, of SECOND_ROLES, whose maps lie on
    the mesh's second texture coordinates (data.Mesh.uvs1). unlit: whether no light changes it: it gives off
    its colour, which stands in `emission`. reflected: pictures of colour and metalness are still to be made
    of it (build/materials/metal_pictures.py); until then `color` is that of what is not reflected.
    """

    name: str
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    opacity: float = 1.0
    alpha_mode: AlphaMode | None = None
    alpha_cutoff: float = 0.5
    two_sided: bool | None = None
    roughness: float | None = None
    smoothness: float = 1.0
    metalness: float | None = None
    specular: float | None = None
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal_scale: float = 1.0
    green_down: bool | None = None
    occlusion_strength: float = 1.0
    bump_m: float | None = None
    maps: dict[str, MapSource] = field(default_factory=dict)
    second: tuple[str, ...] = ()
    unlit: bool = False
    reflected: Reflected | None = None

    @property
    def leading(self) -> MapSource | None:
        """The map whose sampler all maps get: of the colour, or the first; None without maps."""
        return self.maps.get("color") or next(iter(self.maps.values()), None)

    def parts(self) -> tuple[Material, Material]:
        """The material with its maps on the first texture coordinates, and with those on the second."""
        second = {role: source for role, source in self.maps.items() if role in self.second}
        first = {role: source for role, source in self.maps.items() if role not in second}
        return replace(self, maps=first, second=()), replace(self, maps=second)

    def picture(self, role: str) -> Path | None:
        """The file of a map's picture; None without this map."""
        source = self.maps.get(role)
        return source.picture.file if source else None


def uv_width(bounds: tuple[float, float, float, float] | None) -> float:
    """How wide UVs are along u or v, whichever is more, in tiles. bounds: the least and the largest of them
    (u, v, u, v); None: they fill a tile."""
    low_u, low_v, high_u, high_v = bounds or (0.0, 0.0, 1.0, 1.0)
    return max(high_u - low_u, high_v - low_v)


def repeating(width: float) -> str:
    """Says that no occlusion is cast for UVs of this width (uv_width)."""
    return (
        f"its UVs repeat ({width:.3g} tiles wide, up to {1.0 + OVERHANG:g} are taken), so that a texel has "
        "no place of its own"
    )


def texels_within(index: Any, size: int, wrap: Wrap) -> Any:
    """The texels (0 to size - 1) that samplers read for indices beyond the edges. index: an array of whole
    numbers, as floats where they may be large."""
    if wrap == "clamp":
        found = index.clip(0, size - 1)
    elif wrap == "repeat":
        found = index % size
    else:
        turned = index % (2 * size)
        found = turned - (turned >= size) * (2 * (turned - size) + 1)
    return found.astype("int64")
