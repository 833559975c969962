"""The settings of the bakers: one frozen dataclass each, made from a scene or from the command line.

`asdict` of one is what the job's key hashes and what a worker is sent. A setting that bears the same name in
`settings/` or on the command line is taken over by itself: `BakerSettings.of`. Sounds have no settings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal, Self

from paradize.errors import ArgumentError
from paradize.map_table import AUTHORED, DERIVED
from paradize.scene.schema.field import suggestion
from paradize.scene.settings import Relief, SceneObject


@dataclass(frozen=True, kw_only=True)
class BakerSettings:
    """The base of all settings of bakers. An unknown name raises ArgumentError."""

    def __new__(cls, *given: Any, **named: Any) -> Self:
        known = [field.name for field in fields(cls)]
        for name in named:
            if name not in known:
                raise ArgumentError(f"has no {name[:80]!r}", place=cls.__name__, mend=suggestion(name, known))
        return super().__new__(cls)

    @classmethod
    def of(cls, given: object, /, **more: Any) -> Self:
        """The settings with the values that `given` has under the same names: a part of a scene, or the
        arguments of a command line. more: those that it does not tell, or tells otherwise."""
        names = [field.name for field in fields(cls) if hasattr(given, field.name)]
        return cls(**{name: getattr(given, name) for name in names} | more)


@dataclass(frozen=True, kw_only=True)
class MeshSettings(BakerSettings):
    """The settings of a GLB, beside its source and tier.

    lods: levels at most, level 0 included, 1 to 8. max_error: largest surface distance of any level, of the
    bounding box's diagonal, 0 to 1 (None: a tenth of it, or the largest of `lod_errors` where that is more).
    lod_ratio: level k aims at lod_ratio ** k of the triangles of level 0, 0.05 to 0.95. lod_errors: rising
    bounds of the levels after the source, of the diagonal, instead of lod_ratio: each is the coarsest mesh
    inside its bound. screen_size: fields of bakers/mesh/lods_by_screen_size.ScreenSize, for levels by how
    they look.
    flight_views, instances: for levels by what the flight sees, as lods_from_path.py takes them.
    simplifier: what makes the levels, one of SIMPLIFIERS; another than ours has tier balanced alone.
    atlas: make texture coordinates where there are none or they overlap; painted: only where there are none,
    since maps are painted for those there are. unwrapper: what makes them, one of UNWRAPPERS.
    weld_m: join places at most this far apart, metres, 0 or more. crease_deg: 0 to 180, where normals are
    missing and the file names no smoothing groups: faces at a larger angle meet in an edge. tangents: the
    tier of tangent frames, as stages/tangents names them.
    quantise: vertices as 16-bit integers inside these limits (metric -> worst value; none: as
    stages/quantise.py has it); None: as floats.
    base_colors: linear RGB by material, instead of all factors of the model's materials. attributes: of
    the mesh (glTF's names), those that the GLB holds; None: all. second_frames: the materials whose tangents
    follow the second texture coordinates, since their normal map lies there; None: as the model says.
    """

    lods: int = SceneObject.lods
    max_error: float | None = None
    lod_ratio: float = SceneObject.lod_ratio
    lod_errors: Sequence[float] = ()
    screen_size: Mapping[str, Any] | None = None
    flight_views: dict[str, Any] | None = None
    instances: Sequence[Mapping[str, Any]] = ()
    simplifier: str = SceneObject.simplifier
    atlas: bool = False
    painted: bool = False
    unwrapper: str = SceneObject.unwrapper
    weld_m: float = SceneObject.weld_m
    crease_deg: float = SceneObject.crease_deg
    tangents: str = SceneObject.tangents
    quantise: Mapping[str, float] | None = None
    base_colors: Mapping[str, Sequence[float]] | None = None
    attributes: Sequence[str] | None = None
    second_frames: Sequence[str] | None = None


@dataclass(frozen=True, kw_only=True)
class TextureSettings(BakerSettings):
    """The settings of every texture.

    wrap: "repeat" or "clamp", or one for each of (x, y). budget: metric -> worst value; where the blocks of
    a format exceed it, a more exact format is taken. zstd: level of supercompression, 1 to 22; None: none.
    uncompressed: only the most exact of its formats will do. layout_materials: the materials of the UV
    layout's model whose triangles lie on the texture; empty: all.
    """

    wrap: str | tuple[str, str] = "clamp"
    budget: Mapping[str, float] = field(default_factory=dict)
    zstd: int | None = None
    uncompressed: bool = False
    layout_materials: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True)
class MapSettings(TextureSettings, Relief):
    """The settings of the maps of a picture, beside the picture, its UV layout and the tier. The fields of
    Relief (scene/settings/relief.py) shape its heights and choose the filter of their slopes.

    only: the maps to make, of map_table.DERIVED. source: "color" (heights are the luminance), "height",
    or "auto" as readers/heightmap.py guesses. nodata: as there, of heights. strength: full white stands so
    many percent of the map's width high, -1e6 to 1e6; where heights leave 0..1 the highest is white and the
    lowest black. slope_scale replaces it: one unit of height over the texel's size, both in metres, along
    (x, y). size_m: what the map is stretched over along (x, y), metres, so that its texels need not be
    square there; None: they are.
    green: "up" or "down", of normals and du/dv. fmt: "ktx2", with all mips, or "png".
    gloss_groups: groups or materials of the UV layout's model that shine; empty: all.
    """

    only: Sequence[str] = DERIVED
    source: str = "auto"
    nodata: float | Literal["auto", "none"] = "auto"
    strength: float = 1.0
    slope_scale: float | tuple[float, float] | None = None
    size_m: Sequence[float] | None = None
    green: str = "up"
    fmt: str = "ktx2"
    gloss_groups: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True)
class ColorSettings(TextureSettings):
    """The settings of a colour texture, beside its pictures, their UV layout and the tier. product: "color",
    or "emission", which has no alpha. alpha_cutoff: each mip keeps the share of texels that pass it, 0 to 1;
    0: alpha is averaged. opaque: alpha does not count, and the texture has none. Of the picture of alpha:
    alpha_channel, what of it counts, as material.Channel ("luminance": its alpha where it has any, else its
    brightness); alpha_inverted: its values count as 1 - value. white: of the image only its size counts.
    srgb: as of material.MapSource."""

    product: Literal["color", "emission"] = "color"
    alpha_cutoff: float = 0.5
    opaque: bool = False
    alpha_channel: str = "luminance"
    alpha_inverted: bool = False
    white: bool = False
    srgb: bool = False


@dataclass(frozen=True, kw_only=True)
class CastSettings(BakerSettings):
    """The settings of ambient occlusion that is cast from a mesh, beside the mesh and the tier, which is the
    number of rays.

    occlusion_px: side of its map, texels, 16 to 8192. occlusion_reach: what lies farther from a place holds
    back no light, of the bounding box's diagonal, above 0, up to 1. see_through: materials whose triangles
    hold back no light. crease_deg: as of MeshSettings.
    """

    occlusion_px: int = 512
    occlusion_reach: float = 0.25
    see_through: Sequence[str] = ()
    crease_deg: float = SceneObject.crease_deg


@dataclass(frozen=True, kw_only=True)
class OcclusionSettings(TextureSettings, CastSettings):
    """The settings of the occlusion map of a model by itself. fmt: "ktx2", with all mips, or "png"."""

    fmt: str = "ktx2"


@dataclass(frozen=True, kw_only=True)
class AuthoredSettings(TextureSettings, CastSettings):
    """The settings of authored maps, beside the pictures by role, their UV layout and the tier. Roles:
    "normal", "height", "roughness", "smoothness", "specular", "metalness", "occlusion".

    only: the maps to make, of map_table.AUTHORED: normal; height; gloss of roughness or smoothness and
    specular; occlusion, with metalness beside it. channels: role -> what of its picture counts, as
    material.Channel; by itself all of a normal map, and the luminance of other pictures. inverted: roles
    whose values count as 1 - value.
    green_down: whether green points down in the normal map; None: as its slopes say, with a warning. Factors
    of the material, which are baked in where the map has a picture: normal_scale, of x and y; roughness,
    metalness, specular, 0 to 1; occlusion_strength, 0 to 1. occlusion_cast: the occlusion is cast from the UV
    layout's model. bumps: where the material's normals are made of a picture instead of drawn, the fields of
    MapSettings that they are made with; the picture has the role "bumps", and only gloss reads it.
    brightness: the same of gloss that is made of a picture, which has the role "brightness".
    """

    only: Sequence[str] = AUTHORED
    channels: Mapping[str, str] = field(default_factory=dict)
    inverted: Sequence[str] = ()
    green_down: bool | None = None
    normal_scale: float = 1.0
    roughness: float = 1.0
    metalness: float = 1.0
    specular: float = 1.0
    occlusion_strength: float = 1.0
    occlusion_cast: bool = False
    bumps: Mapping[str, Any] | None = None
    brightness: Mapping[str, Any] | None = None


@dataclass(frozen=True, kw_only=True)
class CubemapSettings(BakerSettings):
    """The settings of the sky's cube map, beside its faces. zstd: as of TextureSettings."""

    zstd: int | None = None


@dataclass(frozen=True)
class SoundSettings(BakerSettings):
    """placed: the scene plays it at a place, for which it should be mono."""

    placed: bool = False


@dataclass(frozen=True, kw_only=True)
class TerrainSettings(BakerSettings):
    """The settings of the mesh of a heightmap, beside the heightmap and the tier.

    size_m: along (x, z), from the first to the last pixel, metres. height_m, base_m, height_scale, nodata,
    encoding: as readers/heightmap.py takes them. max_error_m: largest vertical error, metres, 0 or more;
    None: a thousandth of height_m, of metres of what they span, and at least a step of 8 bits or of a tile.
    sand_repeat: how many times the sand pattern repeats along each side. quantise: vertices as 16-bit
    integers, inside the same bound.
    """

    size_m: tuple[float, float]
    height_m: float | None = None
    base_m: float = 0.0
    height_scale: float = 1.0
    nodata: float | Literal["auto", "none"] = "auto"
    encoding: str = "grey"
    max_error_m: float | None = None
    sand_repeat: float = 1.0
    quantise: bool = False


@dataclass(frozen=True, kw_only=True)
class TileSettings(TerrainSettings):
    """The settings of the tiles of a terrain. max_error_m: of the finest level; tier "exact" makes it 0.

    patch_px: side of the finest cells, pixels. tile_mb: a tile's limit, megabytes, up to 64; a patch that is
    larger has a tile for itself. tangents: whether anything reads them. flight_views: as query.plan_query
    takes it; None: every patch is made. floor_cells: the table `floor` of the highest ground has at most so
    many cells along a side; 0: there is no such table.
    """

    max_error_m: float = 0.03
    patch_px: int = 128
    tile_mb: float = 64.0
    tangents: bool = True
    flight_views: dict[str, Any] | None = None
    floor_cells: int = 0
