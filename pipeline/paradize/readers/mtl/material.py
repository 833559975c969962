"""Makes a material of its MTL statements.

A map replaces the factor that it goes with. The format multiplies the two, and so does three.js; but Blender
and others write the colour that a picture stands in place of (Kd 0.8 beside map_Kd), and Blender's importer
drops it again.

In files that Blender wrote, map_Ns and refl name pictures of roughness and metalness, map_Bump a normal map,
and Ka beside illum 3 or 6 is the metalness.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from paradize.material import MAX_BUMP_M, MAX_NORMAL_SCALE, Channel, MapSource, Material, Picture
from paradize.readers.mtl.bump import bump_of_file
from paradize.readers.mtl.maps import MapStatement
from paradize.readers.mtl.phong import (
    roughness_of,
    specular_of,
    specular_of_blender,
    specular_of_reflectance,
)
from paradize.readers.ranges import beyond, within
from paradize.readers.uv_transform import UvTransform

# The role of each map statement's picture. Where two statements have one role, the first one here counts.
ROLES = {"map_kd": "color", "map_d": "alpha", "map_tr": "alpha", "norm": "normal", "map_kn": "normal"}
ROLES |= {"map_bump": "height", "bump": "height", "map_disp": "height", "disp": "height"}
ROLES |= {"map_pr": "roughness", "map_ns": "smoothness", "map_pm": "metalness", "map_ks": "specular"}
ROLES |= {"map_ke": "emission", "map_ao": "occlusion"}
BLENDER_ROLES = ROLES | {"map_ns": "roughness", "map_refl": "metalness", "refl": "metalness"}
_BUMPS = ("map_bump", "bump")
_NORMAL_NAMES = ("_n", "_nrm", "_nor", "_nml", "_norm", "normal", "normals", "normalmap", "normal_map")
_SCALARS = ("alpha", "height", "roughness", "smoothness", "metalness", "specular", "occlusion")

_FARTHEST = 1e6  # scale and offset of texture coordinates, tiles

Warn = Callable[[int, str], None]


@dataclass
class Statements:
    """The statements of one material, by keyword in small letters. blender: as Blender writes them."""

    values: dict[str, tuple[float, ...]] = field(default_factory=dict)
    maps: dict[str, MapStatement] = field(default_factory=dict)
    blender: bool = False

    def number(self, key: str) -> float | None:
        return self.values[key][0] if key in self.values else None

    def color(self, key: str, default: float) -> tuple[float, float, float]:
        red, green, blue = self.values.get(key, (default,) * 3)
        return red, green, blue


def material_of(name: str, statements: Statements, warn: Warn) -> tuple[Material, UvTransform | None]:
    """Returns the material, and how its texture coordinates move. warn: takes a line and a text."""
    number, blender = statements.number, statements.blender
    roles = _roles(statements, warn)
    exponent, roughness, metalness, illum = number("ns"), number("pr"), number("pm"), number("illum")
    specular = None
    if illum in (0.0, 1.0):  # light without highlights
        specular = 0.0
    elif "ks" in statements.values:
        specular = _specular(statements, colored="color" in roles)
    if roughness is None and exponent is not None:
        roughness = roughness_of(exponent, blender)
    if metalness is None and blender and illum in (3.0, 6.0):
        metalness = number("ka")
    clear = 1.0 - statements.values["d"][0] if "d" in statements.values else number("tr") or 0.0
    opacity = 1.0 if "alpha" in roles else 1.0 - clear
    normal, height = roles.get("normal"), roles.get("height")
    steepness = _limited(normal, normal.bump if normal else None, MAX_NORMAL_SCALE, warn)
    bump = _limited(height, height.height if height else None, MAX_BUMP_M, warn)
    material = Material(
        name,
        color=(1.0, 1.0, 1.0) if "color" in roles else statements.color("kd", 1.0),
        opacity=opacity,
        alpha_mode="blend" if opacity < 1.0 else None,
        roughness=None if {"roughness", "smoothness"} & roles.keys() else roughness,
        metalness=None if "metalness" in roles else metalness,
        specular=None if "specular" in roles else specular,
        emission=(1.0, 1.0, 1.0) if "emission" in roles else statements.color("ke", 0.0),
        normal_scale=1.0 if steepness is None else steepness,
        bump_m=None if bump is None else abs(bump),
        maps={role: _source(role, one, roles) for role, one in roles.items()},
    )
    return material, _transform(name, roles, warn)


def _limited(one: MapStatement | None, value: float | None, limit: float, warn: Warn) -> float | None:
    """A factor of a map, at most `limit` either way, with a warning beyond; None where there is none."""
    if one is None or value is None:
        return None
    (found,) = within((value,), -limit, limit)
    if found != value:
        warn(one.line, f"{one.keyword}: -bm {beyond((value,), -limit, limit, (found,))}")
    return found


def _specular(statements: Statements, *, colored: bool) -> float:
    """Material.specular of Ks. colored: the material has a colour map."""
    ks = statements.color("ks", 0.0)
    if statements.blender:
        return specular_of_blender(ks)
    if statements.number("pr") is not None:  # physically based
        return specular_of_reflectance(ks)
    kd = 1.0 if colored else max(statements.color("kd", 1.0))
    return specular_of(ks, statements.number("ns"), kd=kd)


def _roles(statements: Statements, warn: Warn) -> dict[str, MapStatement]:
    """The map statement of each role."""
    roles: dict[str, MapStatement] = {}
    for key, role in (BLENDER_ROLES if statements.blender else ROLES).items():
        one = statements.maps.get(key)
        if one is None:
            continue
        if key in _BUMPS:
            role = _role_of_bump(one, statements.blender, warn)
        elif role == "smoothness" and "roughness" in roles:
            role = "roughness"  # the same property
        before = roles.setdefault(role, one) if role else one
        if before.file != one.file:
            warn(one.line, f"{key}: line {before.line} names this material's {role} already; ignored")
    return roles


def _role_of_bump(one: MapStatement, blender: bool, warn: Warn) -> str:
    """Normal or height; empty where the picture is neither."""
    if blender:
        return "normal"
    held = "height" if one.channel else bump_of_file(one.file)
    named_normal = one.file.stem.lower().endswith(_NORMAL_NAMES)
    if held == "unreadable":
        return "normal" if named_normal else "height"
    if held == "unclear" and named_normal:
        what = "is named like a normal map, but few of its texels are directions out of the surface; ignored"
        warn(one.line, f"bump map {one.file.name!r} {what}")
        return ""
    if held == "unclear":
        warn(one.line, f"bump map {one.file.name!r} is coloured; its luminance is read as heights")
    return "normal" if held == "normal" else "height"


def _source(role: str, one: MapStatement, roles: Mapping[str, MapStatement]) -> MapSource:
    channel: Channel = one.channel or ("luminance" if role in _SCALARS else "rgb")
    if role == "alpha" and not one.channel and "color" in roles and roles["color"].file == one.file:
        channel = "a"
    inverted = one.keyword == "map_tr" or (role == "height" and (one.height or 0.0) < 0.0)
    return MapSource(Picture(one.file, name=one.file.name), channel, one.wrap, inverted=inverted)


def _transform(name: str, roles: Mapping[str, MapStatement], warn: Warn) -> UvTransform | None:
    """How the texture coordinates move: as the colour map says, or the first map without one."""
    if not roles:
        return None
    leading = roles.get("color") or next(iter(roles.values()))
    for one in roles.values():
        if (one.scale, one.offset) != (leading.scale, leading.offset):
            what = f"-s and -o differ from those of line {leading.line}, which all maps of {name[:120]!r} get"
            warn(one.line, f"{one.keyword}: {what}")
    said = (*leading.scale, *leading.offset)
    sx, sy, ox, oy = within(said, -_FARTHEST, _FARTHEST)
    if (sx, sy, ox, oy) != said:
        taken = beyond(said, -_FARTHEST, _FARTHEST, (sx, sy, ox, oy))
        warn(leading.line, f"{leading.keyword}: -s and -o {taken}")
    if (sx, sy, ox, oy) == (1.0, 1.0, 0.0, 0.0):
        return None
    # v' = sy v + oy upwards; w = 1 - v downwards: w' = 1 - sy (1 - w) - oy
    return ((sx, 0.0, ox), (0.0, sy, 1.0 - sy - oy))
