"""How the texture coordinates of a material move as -s and -o of its maps say."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from paradize.material import REPEATED, SECOND_ROLES, Placed, Wrap
from paradize.readers.mtl.maps import MapStatement
from paradize.readers.placed import Bounds, placed_on
from paradize.readers.ranges import beyond, within
from paradize.readers.uv_transform import UNMOVED, UvTransform, UvTransforms

Warn = Callable[[int, str], None]
BoundsOf = Callable[[str], Bounds | None]
_FARTHEST = 1e6  # scale and offset of texture coordinates, tiles


def transforms_of(
    name: str, roles: Mapping[str, MapStatement], bounds: BoundsOf, warn: Warn
) -> tuple[UvTransforms | None, tuple[str, ...], dict[str, Placed]]:
    """How the texture coordinates move, the roles whose maps lie on second ones, and how maps that lie on
    neither are drawn anew for the first. The first ones are as the colour map says, or the first map without
    one; the second as the first map that says otherwise and may."""
    if not roles:
        return None, (), {}
    leading = roles.get("color") or next(iter(roles.values()))
    others = [role for role, statement in roles.items() if _placed(statement) != _placed(leading)]
    able = [role for role in others if _may_lie_elsewhere(role, roles, others)]
    first = _transform(leading, warn)
    anew = {
        role: found
        for role in others
        if (found := _drawn_anew(role, roles[role], first, bounds(name), leading.wrap)) is not None
    }
    # second coordinates cost no picture, and are all there is for what cannot be drawn anew
    at = next((roles[role] for role in sorted(able, key=anew.__contains__)), None)
    second = tuple(role for role in able if at is not None and _placed(roles[role]) == _placed(at))
    for role in others:
        if role not in anew and role not in second:
            which = f"differ from those of line {leading.line}, which this map of {name[:120]!r} gets"
            why = "it is mirrored" if role == "normal" else "they are no whole number of its tiles"
            warn(roles[role].line, f"{roles[role].keyword}: -s and -o {which}: {why}; draw it for those")
    placed = {role: found for role, found in anew.items() if role not in second}
    if first == UNMOVED and at is None:
        return None, (), placed
    return UvTransforms(first, None if at is None else _transform(at, warn)), second, placed


def _drawn_anew(
    role: str,
    statement: MapStatement,
    first: UvTransform,
    bounds: Bounds | None,
    wrap: tuple[Wrap, Wrap] | None,
) -> Placed | None:
    """How a map is drawn anew for texture coordinates that move as `first` and samplers that wrap as `wrap`;
    None where it cannot be."""
    (su, _, ou), (_, sv, ov) = _transform(statement, lambda *_: None)
    (tu, _, pu), (_, tv, pv) = first
    if tu == 0.0 or tv == 0.0:
        return None
    scale = su / tu, sv / tv
    if role == "normal" and min(scale) <= 0.0:
        return None  # its slopes would have to turn, too
    offset = ou - scale[0] * pu, ov - scale[1] * pv
    moved = None
    if bounds is not None:
        us = sorted(tu * bounds[k] + pu for k in (0, 2))
        vs = sorted(tv * bounds[k] + pv for k in (1, 3))
        moved = us[0], vs[0], us[1], vs[1]
    return placed_on(scale, offset, moved, (statement.wrap or REPEATED, wrap or REPEATED))


def _placed(statement: MapStatement) -> tuple[tuple[float, float], tuple[float, float]]:
    return statement.scale, statement.offset


def _may_lie_elsewhere(role: str, roles: Mapping[str, MapStatement], others: Collection[str]) -> bool:
    """Whether a map may lie on second texture coordinates. What gloss is made of lies in one place."""
    split = role in ("roughness", "smoothness") and "specular" in roles and "specular" not in others
    return role in SECOND_ROLES and not split


def _transform(statement: MapStatement, warn: Warn) -> UvTransform:
    """How a map's -s and -o move texture coordinates."""
    said = (*statement.scale, *statement.offset)
    sx, sy, ox, oy = within(said, -_FARTHEST, _FARTHEST)
    if (sx, sy, ox, oy) != said:
        warn(
            statement.line,
            f"{statement.keyword}: -s and -o {beyond(said, -_FARTHEST, _FARTHEST, (sx, sy, ox, oy))}",
        )
    # v' = sy v + oy upwards; w = 1 - v downwards: w' = 1 - sy (1 - w) - oy
    return ((sx, 0.0, ox), (0.0, sy, 1.0 - sy - oy))
