# ruff: noqa: RUF009 (the calls in the dataclasses make their fields)
"""Objects, their materials and where they stand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paradize import player_limits
from paradize.material import WRAPS
from paradize.scene import ranges
from paradize.scene.schema import (
    choice,
    choices,
    flag,
    identifier,
    named_tables,
    number,
    numbers,
    point,
    scale,
    source,
    table,
    tables,
    texts,
    whole,
)
from paradize.scene.settings.motion import Motion
from paradize.scene.settings.relief import Relief
from paradize.tiers import SIMPLIFIERS, UNWRAPPERS

RESERVED = frozenset({"terrain", "sand", "effect", "water", "sky", "clouds", "sound"})  # no names of objects


@dataclass(frozen=True, kw_only=True)
class ObjectMaterial:
    """A material as the scene sees it. None and "auto": as the model says."""

    color: Path | None = source(None, meaning="colour map, instead of the model's")
    alpha: Path | None = source(None, meaning="grey picture of the alpha; without it the alpha of color")
    normal: Path | None = source(None, meaning="normal map")
    green: str = choice(
        "auto",
        among=("auto", "up", "down"),
        meaning="where green points in the normal map; auto: as the model says, or as its slopes look",
    )
    height: Path | None = source(
        None, meaning="heights, for parallax, and for normals where there is no normal map"
    )
    roughness: Path | None = source(None, meaning="roughness map")
    smoothness_map: Path | None = source(None, meaning="smoothness map, instead of roughness")
    specular_map: Path | None = source(None, meaning="map of the intensity of highlights")
    metalness: Path | None = source(None, meaning="metalness map")
    occlusion: Path | None = source(
        None,
        meaning="map of ambient occlusion; where one picture is named for two or more of occlusion, "
        "roughness and metalness, they are its red, green and blue",
    )
    emission: Path | None = source(None, meaning="colour map of the light that it gives off")
    wrap: str | tuple[str, str] = choice(
        "auto",
        among=("auto", *WRAPS),
        pair="along u and along v",
        meaning="what lies beyond the edges of its maps: the map again, its last texels, or its mirror "
        "image; auto: as the object or the model says, else repeat",
    )
    filter: str = choice(
        "auto",
        among=("auto", "linear", "nearest"),
        meaning="enlarged texels are mixed, or are squares, as pixel art needs; auto: as the model says",
    )
    parallax_scale: float = number(
        0.0,
        low=0.0,
        high=1.0,
        unit="of the texture's width",
        meaning="depth of the height map for parallax; 0: none",
    )
    parallax_bias: float = number(
        0.0, low=-1.0, high=1.0, meaning="added to the depth, so that the surface rises or sinks"
    )
    specular: float | None = number(
        None,
        low=0.0,
        high=10.0,
        meaning="intensity of highlights; 0: no gloss map; without it the model's, or 0 if it says nothing",
    )
    smoothness: float | None = number(
        None, low=0.0, high=1.0, meaning="0: rough, 1: mirror; without it the model's, or 0.3"
    )
    metalness_factor: float | None = number(
        None, low=0.0, high=1.0, meaning="0: no metal, 1: metal; without it the model's, or 0"
    )
    two_sided: bool | None = flag(None, meaning="draw back faces; without it the model's, or false")
    translucency: float | None = number(
        None,
        low=0.0,
        high=1.0,
        meaning="share of the light from behind that passes through, as through a leaf; without it 0.55 for "
        "two-sided masks whose colour map is mostly green, and 0",
    )
    vertex_lit: bool = flag(
        False,
        meaning="light is found at the vertices, not in each pixel: much quicker for grass and leaves of "
        "small triangles, coarse on large ones; only above water, without highlights or maps but color",
    )
    alpha_mode: str = choice(
        "auto",
        among=("auto", "opaque", "mask", "blend"),
        meaning="what alpha does: nothing, holes, or mixing with what lies behind; auto: as the model says, "
        "or as the alpha of its colour map looks; nothing where no alpha is below 1",
    )
    alpha_cutoff: float | None = number(
        None, low=0.0, high=1.0, meaning="texels with less alpha are holes; 0: none"
    )


def _angle(meaning: str) -> Any:
    return number(0.0, low=-3600.0, high=3600.0, unit="degrees", meaning=meaning)


@dataclass(frozen=True, kw_only=True)
class Instance:
    position: tuple[float, float, float] = point((0.0, 0.0, 0.0), meaning="position of the model's origin")
    yaw_deg: float = _angle("turn about the vertical axis, after pitch and roll")
    pitch_deg: float = _angle("turn about X, after roll")
    roll_deg: float = _angle("turn about Z")
    scale: float | tuple[float, float, float] = scale(
        1.0,
        low=player_limits.SCALES[0],
        high=player_limits.SCALES[1],
        meaning="size, or sizes along the model's x, y and z; negative: mirrored",
    )


@dataclass(frozen=True, kw_only=True)
class SceneObject:
    name: str = identifier(meaning="names the object's artifacts")
    mesh: Path = source(meaning="OBJ, GLB, glTF, PLY or STL file")
    color: Path | None = source(
        None, meaning="colour map of all materials; without it each has that of the model"
    )
    alpha: Path | None = source(None, meaning="grey picture of the alpha; without it the alpha of color")
    lods: int = whole(4, **ranges.LODS, meaning="number of levels of detail, the source included")
    max_error: float | None = number(
        None,
        **ranges.MAX_ERROR,
        unit="of the diagonal",
        meaning="largest error of a level; without it 0.1, or the largest of lod_errors",
    )

    lods_by: str = choice(
        "ratio",
        among=("ratio", "error", "screen_size", "flight"),
        meaning="levels by share of triangles, by error, by how they look, or by what the flight can see",
    )
    lod_ratio: float = number(
        0.5,
        **ranges.LOD_RATIO,
        meaning="triangles of level 1, as a share of level 0; of level 2 its square, and so on",
    )
    lod_errors: tuple[float, ...] = numbers(
        (),
        **ranges.MAX_ERROR,
        unit="of the diagonal",
        meaning='error of each level after the first, with lods_by = "error"',
    )
    lod_size_px: float | None = number(
        None,
        **ranges.LOD_SIZE_PX,
        unit="pixels",
        meaning="along the diagonal, where level 1 takes over, and each next at half; without it 256. With "
        'lods_by = "screen_size" only',
    )
    simplifier: str = choice(
        SIMPLIFIERS[0],
        among=SIMPLIFIERS,
        meaning="library that makes the levels; fast-simplification and openmesh see only positions: texture "
        "coordinates are taken from the source again, without seams; they take one material, openmesh only "
        "manifolds",
    )
    unwrapper: str = choice(
        UNWRAPPERS[0], among=UNWRAPPERS, meaning="library that makes UVs for a mesh without them"
    )
    weld_m: float = number(
        0.0, **ranges.WELD_M, unit="m", meaning="vertices closer than this are joined; 0: none"
    )
    crease_deg: float = number(
        45.0,
        **ranges.CREASE_DEG,
        unit="degrees",
        meaning="where normals are missing, faces at a larger angle meet in a sharp edge",
    )
    tangents: str = choice(
        "mikktspace",
        among=ranges.TANGENTS,
        meaning="tangent frames: those of MikkTSpace, or the mean at each vertex; face: the same as vertex",
    )
    quantise: bool = flag(False, meaning="16-bit vertices; the budget limits their error")
    views: tuple[str, ...] = choices(
        player_limits.VIEWS,
        among=player_limits.VIEWS,
        meaning="views that draw the object, if the scene has them",
    )
    wrap: str = choice(
        "auto",
        among=("auto", *WRAPS),
        meaning="what lies beyond the edges of its maps; auto: as its materials say",
    )
    strength: float | None = number(
        None,
        **ranges.STRENGTH,
        unit="% of the width",
        meaning="height of full white of the bumps made from the colour; 0: no normal map; without it 1, and "
        "0 for glTF and for a model that brings normal or roughness maps",
    )
    bleed: float = number(
        0.125,
        low=0.0,
        high=1.0,
        unit="of the range",
        meaning="how much neighbours in the UV layout may bleed into a sample",
    )
    relief: Relief = table(Relief, Relief, meaning="How the picture becomes heights.")
    occlusion: str = choice(
        "none",
        among=("none", "mesh"),
        meaning="mesh: materials without a map of ambient occlusion get one that is cast from the mesh; "
        "materials with holes, and blended ones, hold back no light",
    )
    occlusion_px: int = whole(
        512, **ranges.OCCLUSION_PX, unit="texels", meaning="side of the occlusion map that is cast"
    )
    occlusion_reach: float = number(
        0.25,
        **ranges.OCCLUSION_REACH,
        unit="of the diagonal",
        meaning="what lies farther than this holds back no light",
    )
    sway_m: float = number(
        0.0,
        low=0.0,
        high=100.0,
        unit="m",
        meaning="how far what is farthest from its root leans in a full gust, whatever the instance's scale; "
        "0: it stands still",
    )
    flutter_m: float = number(
        0.0,
        low=0.0,
        high=10.0,
        unit="m",
        meaning="how far the tips of what hangs on it, as leaves, beat in a full gust",
    )
    motion: Motion | None = table(Motion, None, meaning="How it moves. Without this table it stands.")
    gloss_groups: tuple[str, ...] = texts((), meaning="groups or materials that shine; empty: all")
    materials: dict[str, ObjectMaterial] = named_tables(
        ObjectMaterial, key="material", meaning="A material of the model, by its name."
    )
    instances: tuple[Instance, ...] = tables(
        Instance,
        least=1,
        key="instance",
        instead="instances",
        meaning="Where the object stands. One table for each copy, or a file of `instances`.",
    )
    instances_file: Path | None = source(
        None,
        key="instances",
        meaning="CSV file of more instances: columns x, y, z, and optional yaw_deg, pitch_deg, roll_deg, "
        "scale or scale_x, scale_y, scale_z",
    )
