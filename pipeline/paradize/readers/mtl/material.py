"""Makes a material of its MTL statements.

A map replaces the factor that it goes with. The format multiplies the two, and so does three.js; but Blender
and others write the colour that a picture stands in place of (Kd 0.8 beside map_Kd), and Blender's importer
drops it again. Maya writes Kd 0, which would be a black model where the picture is missing.

In files that Blender wrote, map_Ns and refl name pictures of roughness and metalness, map_Bump a normal map,
and Ka beside illum 3 or 6 is the metalness.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from paradize.material import (
    MAX_BUMP_M,
    MAX_NORMAL_SCALE,
    Channel,
    MapSource,
    Material,
    Picture,
    Placed,
)
from paradize.readers.mtl.bump import bump_of_file
from paradize.readers.mtl.maps import MapStatement
from paradize.readers.mtl.phong import (
    roughness_of,
    specular_of,
    specular_of_blender,
    specular_of_reflectance,
)
from paradize.readers.mtl.texture_transform import BoundsOf, Warn, transforms_of
from paradize.readers.names import said_of
from paradize.readers.ranges import beyond, within
from paradize.readers.uv_transform import UvTransforms

# The role of each map statement's picture. Where two statements have one role, the first one here counts.
ROLES = {"map_kd": "color", "map_d": "alpha", "map_tr": "alpha", "norm": "normal"}
ROLES |= dict.fromkeys(("map_kn", "map_norm", "map_normal"), "normal")
ROLES |= {"map_bump": "height", "bump": "height", "map_disp": "height", "disp": "height"}
ROLES |= {"map_pr": "roughness", "map_ns": "smoothness", "map_pm": "metalness", "map_ks": "specular"}
ROLES |= {"map_ke": "emission", "map_emissive": "emission", "map_ao": "occlusion"}
# Pictures that hold a map in each channel, in the order of red, green and blue, as DirectXMesh names them.
_RGB: tuple[Channel, ...] = ("r", "g", "b")
PACKED = {
    "map_orm": ("occlusion", "roughness", "metalness"),
    "map_rma": ("roughness", "metalness", "occlusion"),
}
BLENDER_ROLES = ROLES | {"map_ns": "roughness", "map_refl": "metalness", "refl": "metalness"}
_BUMPS = ("map_bump", "bump")
_SCALARS = ("alpha", "height", "roughness", "smoothness", "metalness", "specular", "occlusion")

# Maps that a gain of at most 1 scales as a factor does. A colour's gain would scale sRGB codes.
_SCALED = ("alpha", "roughness", "metalness", "specular")


@dataclass
class Statements:
    """The statements of one material, by keyword in small letters. values: () of a map that is not there.
    lines: of `values`. blender, meshlab: as these write them."""

    values: dict[str, tuple[float, ...]] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    maps: dict[str, MapStatement] = field(default_factory=dict)
    blender: bool = False
    meshlab: bool = False

    def number(self, key: str) -> float | None:
        return self.values[key][0] if key in self.values else None

    def color(self, key: str, default: float) -> tuple[float, float, float]:
        red, green, blue = self.values.get(key, (default,) * 3)
        return red, green, blue


def material_of(
    name: str, statements: Statements, warn: Warn, bounds: BoundsOf = lambda _: None
) -> tuple[Material, UvTransforms | None]:
    """Returns the material, and how its texture coordinates move. warn: takes a line and a text. bounds: of
    the texture coordinates that a material is used with, before they move; None: not known."""
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
    clear = _clear(statements, warn)
    gains = {
        role: gain for role, statement in roles.items() if (gain := _gain(role, statement, warn)) is not None
    }
    opacity = gains.get("alpha", 1.0) if "alpha" in roles else 1.0 - clear
    transforms, second, placed = transforms_of(name, roles, bounds, warn)
    normal, height = roles.get("normal"), roles.get("height")
    steepness = _limited(normal, normal.bump if normal else None, MAX_NORMAL_SCALE, warn)
    bump = _limited(height, height.height if height else None, MAX_BUMP_M, warn)
    stands_in = "map_kd" in statements.values and not any(statements.color("kd", 1.0))
    material = Material(
        name,
        color=(1.0, 1.0, 1.0) if "color" in roles or stands_in else statements.color("kd", 1.0),
        opacity=opacity,
        alpha_mode="blend" if opacity < 1.0 else None,
        roughness=gains.get("roughness") if {"roughness", "smoothness"} & roles.keys() else roughness,
        metalness=gains.get("metalness") if "metalness" in roles else metalness,
        specular=gains.get("specular") if "specular" in roles else specular,
        emission=(1.0, 1.0, 1.0) if "emission" in roles else statements.color("ke", 0.0),
        normal_scale=1.0 if steepness is None else steepness,
        bump_m=None if bump is None else abs(bump),
        maps={role: _source(role, statement, roles, placed.get(role)) for role, statement in roles.items()},
        occlusion_strength=gains.get("occlusion", 1.0),
        second=second,
    )
    return material, transforms


def _clear(statements: Statements, warn: Warn) -> float:
    """How clear a material is, 0 to 1. Tr is how clear it is, but MeshLab and older exporters write how
    opaque: Tr 1 for what is to be seen."""
    if "d" in statements.values:
        clear = 1.0 - statements.values["d"][0]
        line = statements.lines["d"]
        said = f"d {statements.values['d'][0]:g}"
    elif "tr" in statements.values:
        clear, line = statements.values["tr"][0], statements.lines["tr"]
        said = f"Tr {clear:g}"
        if statements.meshlab:
            return 1.0 - clear
        if clear == 1.0:
            warn(
                line,
                f"{said} would hide the material; read as opaque, which some exporters mean: d 0 hides it",
            )
            return 0.0
    else:
        return 0.0
    if clear == 1.0 and not {"map_d", "map_tr"} & statements.maps.keys():
        warn(line, f"{said}: the material is wholly clear and does not show; d 1 shows it")
    return clear


def _gain(role: str, statement: MapStatement, warn: Warn) -> float | None:
    """The factor that stands for -mm of a map; None without one."""
    if statement.gain is None or role == "height":  # a base moves all heights alike, which no light shows
        return None
    in_range = 0.0 <= statement.gain <= 1.0
    if role == "occlusion" and in_range and statement.base == 1.0 - statement.gain:
        return statement.gain  # the strength: 1 stays 1
    if role in _SCALED and in_range and statement.base == 0.0:
        return statement.gain
    if (statement.base, statement.gain) != (0.0, 1.0):
        warn(
            statement.line,
            f"{statement.keyword}: -mm {statement.base:g} {statement.gain:g} of a map of {role} "
            "has no effect",
        )
    return None


def _limited(statement: MapStatement | None, value: float | None, limit: float, warn: Warn) -> float | None:
    """A factor of a map, at most `limit` either way, with a warning beyond; None where there is none."""
    if statement is None or value is None:
        return None
    (found,) = within((value,), -limit, limit)
    if found != value:
        warn(statement.line, f"{statement.keyword}: -bm {beyond((value,), -limit, limit, (found,))}")
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
        statement = statements.maps.get(key)
        if statement is None:
            continue
        if key in _BUMPS:
            role = _role_of_bump(statement, statements.blender, warn)
        elif role == "smoothness" and "roughness" in roles:
            role = "roughness"  # the same property
        _take(role, statement, roles, warn)
    for key, packed in PACKED.items():
        if (statement := statements.maps.get(key)) is not None:
            for role, channel in zip(packed, _RGB, strict=True):
                _take(role, replace(statement, channel=channel), roles, warn)
    return roles


def _take(role: str, statement: MapStatement, roles: dict[str, MapStatement], warn: Warn) -> None:
    """Makes a statement that of a role, unless another one is."""
    before = roles.setdefault(role, statement) if role else statement
    is_same = (before.file, before.channel) == (statement.file, statement.channel)
    if not is_same and before.keyword != statement.keyword:
        warn(
            statement.line,
            f"{statement.keyword}: line {before.line} names this material's {role} already; ignored",
        )


def _role_of_bump(statement: MapStatement, blender: bool, warn: Warn) -> str:
    """Normal or height; empty where the picture is neither. blender: Blender wrote the statement, whose newer
    versions mean a normal map."""
    held = "height" if statement.channel else bump_of_file(statement.file)
    named_normal = said_of(statement.file.stem)[1] == "normal"
    if held == "unreadable":
        return "normal" if named_normal or blender else "height"
    if held == "unclear" and named_normal:
        what = "is named like a normal map, but few of its texels are directions out of the surface; ignored"
        warn(statement.line, f"bump map {statement.file.name!r} {what}")
        return ""
    return "normal" if held == "normal" else "height"


def _source(
    role: str, statement: MapStatement, roles: Mapping[str, MapStatement], placed: Placed | None
) -> MapSource:
    channel: Channel = statement.channel or ("luminance" if role in _SCALARS else "rgb")
    if (
        role == "alpha"
        and not statement.channel
        and "color" in roles
        and roles["color"].file == statement.file
    ):
        channel = "a"
    inverted = statement.keyword == "map_tr" or (role == "height" and (statement.height or 0.0) < 0.0)
    return MapSource(
        Picture(statement.file, name=statement.file.name),
        channel,
        statement.wrap,
        inverted=inverted,
        placed=placed,
    )
