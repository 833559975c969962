"""Which values each field of the bakers' settings takes, for what a program passes to the library.

A scene and the command line check what they read by rules of their own, with places in a file; here a value
may be of any type. Does not import numpy.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from math import inf, isfinite
from numbers import Integral, Real
from typing import Any

from paradize.errors import ArgumentError, GroupedError
from paradize.map_table import DERIVED
from paradize.scene import ranges
from paradize.scene.budget import METRICS
from paradize.scene.schema.field import suggestion
from paradize.scene.settings.relief import FILTERS
from paradize.tiers import SIMPLIFIERS, UNWRAPPERS

ATTRIBUTES = ("POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0", "_SWAY")


@dataclass(frozen=True)
class Rule:
    """allowed: in words. fault: what is wrong with a value; empty: nothing."""

    allowed: str
    fault: Callable[[Any], str]

    def or_none(self) -> Rule:
        return Rule(f"{self.allowed}, or None", lambda value: "" if value is None else self.fault(value))

    def __or__(self, other: Rule) -> Rule:
        def fault(value: Any) -> str:
            return self.fault(value) and other.fault(value)

        return Rule(f"{self.allowed}, or {other.allowed}", fault)


def _where(allowed: str, is_right: Callable[[Any], bool]) -> Rule:
    return Rule(allowed, lambda value: "" if is_right(value) else f"is {shown(value)}")


def shown(value: object) -> str:
    """A value as a message shows it."""
    if shape := getattr(value, "shape", None):
        return f"{type(value).__name__} of shape {tuple(shape)}"
    return f"{type(value).__name__} {reprlib.repr(value)}"


def is_number(value: object) -> bool:
    """Whether a value is a number; true and false are none."""
    return isinstance(value, Real) and not isinstance(value, bool)


def number(low: float = -inf, high: float = inf, unit: str = "", *, above: bool = False) -> Rule:
    """A finite number from `low`, or above it, to `high`."""
    if low == -inf:
        between = "finite"
    elif high == inf:
        between = f"above {low:g}" if above else f"{low:g} or more"
    else:
        between = f"above {low:g}, up to {high:g}" if above else f"{low:g} to {high:g}"
    return _where(
        f"a number, {between}{' ' + unit if unit else ''}",
        lambda v: is_number(v) and isfinite(v) and (low < v if above else low <= v) and v <= high,
    )


def whole(low: int, high: int | None = None) -> Rule:
    """A whole number from `low` to `high`."""
    allowed = f"a whole number, {low} or more" if high is None else f"a whole number, {low} to {high}"
    return _where(
        allowed,
        lambda v: is_number(v) and isinstance(v, Integral) and low <= int(v) and (high is None or v <= high),
    )


def choice(*names: str) -> Rule:
    """One of these names."""
    return _where(f"one of {', '.join(names)}", lambda v: isinstance(v, str) and v in names)


def instance(kind: type[Any] | tuple[type[Any], ...], allowed: str) -> Rule:
    """An object of a class."""
    return _where(allowed, lambda v: isinstance(v, kind))


def _is_sequence(value: object) -> bool:
    listed = isinstance(value, Sequence | frozenset | set) or hasattr(value, "tolist")
    return listed and not isinstance(value, str | bytes)


def names(among: Collection[str] = (), *, least: int = 0) -> Rule:
    """A sequence of names."""
    allowed = "a sequence of names" + (f" of {', '.join(among)}" if among else "")
    return _where(
        allowed + (", one or more" if least else ""),
        lambda v: (
            _is_sequence(v)
            and len(v) >= least
            and all(isinstance(name, str) and (not among or name in among) for name in v)
        ),
    )


def several(rule: Rule, count: int | None, what: str, *, rising: bool = False) -> Rule:
    """A sequence of values that keep a rule. count: None: any."""

    def is_right(value: Any) -> bool:
        if not _is_sequence(value) or (count is not None and len(value) != count):
            return False
        listed = list(value)
        right = all(not rule.fault(item) for item in listed)
        return right and (not rising or all(a <= b for a, b in pairwise(listed)))

    return _where(what, is_right)


def mapping(keys: Mapping[str, Rule] | None, value: Rule, what: str, required: Collection[str] = ()) -> Rule:
    """A mapping. keys: those there are, with the rules of their values; None: any name, whose value keeps
    `value`."""

    def fault(found: Any) -> str:
        if not isinstance(found, Mapping):
            return f"is {shown(found)}"
        for key, entry in found.items():
            if not isinstance(key, str):
                return f"has the key {shown(key)}"
            if keys is not None and key not in keys:
                return f"has no {key[:80]!r}, {suggestion(key, keys)}"
            rule = value if keys is None else keys[key]
            if wrong := rule.fault(entry):
                return f"{key[:80]} {wrong}, allowed: {rule.allowed}"
        missing = [key for key in required if key not in found]
        return f"lacks {missing[0]!r}" if missing else ""

    return Rule(what, fault)


FLAG = _where("True or False", lambda v: isinstance(v, bool) or type(v).__name__ == "bool_")
TEXT = _where("a text", lambda v: isinstance(v, str))
_WRAP = choice("repeat", "clamp")
_LIMIT = number(0.0)
LIMITS = mapping(dict.fromkeys(METRICS, _LIMIT), _LIMIT, "a dict: metric -> worst value")
_SIZE_M = several(
    number(**ranges.SIZE_M),
    2,
    f"two numbers, (x, z) in metres, each {ranges.SIZE_M['low']:g} to {ranges.SIZE_M['high']:g}",
)
ANY_SIZE_M = _SIZE_M.or_none()
_LEVEL = number(**ranges.LEVEL)
_QUANTISE = {metric: _LIMIT for metric in METRICS if metric.startswith("quantise_")}
_SCREEN = {
    "size_px": number(**ranges.LOD_SIZE_PX, unit="pixels"),
    "normal_deg": number(0.0, 180.0, "degrees"),
    "silhouette": number(0.0, 1.0),
    "flip": number(0.0, 1.0, above=True),
    "two_sided": names(),
}
_TEXTURE = {
    "wrap": _WRAP | several(_WRAP, 2, "two of them, along x and y"),
    "budget": LIMITS,
    "zstd": whole(**ranges.ZSTD).or_none(),
    "uncompressed": FLAG,
    "layout_materials": names(),
    "fmt": choice("ktx2", "png"),
}
_NODATA = number() | choice("auto", "none")
# By the name of the class of settings, then by field.
RULES: dict[str, dict[str, Rule]] = {
    "MeshSettings": {
        "lods": whole(**ranges.LODS),
        "max_error": number(**ranges.MAX_ERROR, unit="of the diagonal").or_none(),
        "lod_ratio": number(**ranges.LOD_RATIO),
        "lod_errors": several(
            number(**ranges.MAX_ERROR), None, "rising numbers, 0 to 1, of the diagonal", rising=True
        ),
        "screen_size": mapping(
            _SCREEN, TEXT, f"a dict of {', '.join(_SCREEN)}", required=["size_px"]
        ).or_none(),
        "flight_views": mapping(None, _where("", lambda _: True), "a dict, of a scene's flight").or_none(),
        "instances": several(instance(Mapping, ""), None, "a sequence of dicts, of a scene's instances"),
        "simplifier": choice(*SIMPLIFIERS),
        "atlas": FLAG,
        "painted": FLAG,
        "unwrapper": choice(*UNWRAPPERS),
        "weld_m": number(**ranges.WELD_M, unit="metres"),
        "crease_deg": number(**ranges.CREASE_DEG, unit="degrees"),
        "tangents": choice(*ranges.TANGENTS),
        "quantise": mapping(
            _QUANTISE, _LIMIT, f"a dict: metric -> worst value, of {', '.join(_QUANTISE)}; {{}} as they are"
        ).or_none(),
        "base_colors": mapping(
            None,
            several(number(0.0, 1.0), 3, "three numbers, 0 to 1, linear RGB"),
            "a dict: material -> linear RGB",
        ).or_none(),
        "attributes": names(ATTRIBUTES).or_none(),
        "second_frames": names().or_none(),
    },
    "MapSettings": {
        **_TEXTURE,
        "only": names(DERIVED, least=1),
        "source": choice("auto", "color", "height"),
        "nodata": _NODATA,
        "strength": number(**ranges.STRENGTH, unit="percent of the width"),
        "slope_scale": (number() | several(number(), 2, "two of them, along x and y")).or_none(),
        "size_m": ANY_SIZE_M,
        "green": choice("up", "down"),
        "gloss_groups": names(),
        **dict.fromkeys(("black", "white", "contrast", "brightness"), _LEVEL),
        "gamma": number(**ranges.GAMMA),
        "invert": FLAG,
        "filter": choice(*FILTERS),
        "destep": FLAG,
    },
    "OcclusionSettings": {
        **_TEXTURE,
        "occlusion_px": whole(**ranges.OCCLUSION_PX),
        "occlusion_reach": number(**ranges.OCCLUSION_REACH, unit="of the diagonal"),
        "see_through": names(),
        "crease_deg": number(**ranges.CREASE_DEG, unit="degrees"),
    },
    "TerrainSettings": {
        "size_m": _SIZE_M,
        "height_m": number(**ranges.HEIGHT_M, unit="metres").or_none(),
        "base_m": number(**ranges.HEIGHT_M, unit="metres"),
        "height_scale": number(**ranges.HEIGHT_SCALE),
        "nodata": _NODATA,
        "encoding": choice(*ranges.ENCODINGS),
        "max_error_m": number(**ranges.MAX_ERROR_M, unit="metres").or_none(),
        "sand_repeat": number(),
        "quantise": FLAG,
    },
}


def require_right(settings: Any, function: str) -> None:
    """Raises ArgumentError, or GroupedError for several, for fields of settings of the library whose values
    are not allowed. function: that they were passed to."""
    rules = RULES[type(settings).__name__]
    errors = [
        ArgumentError(
            f"{wrong}; allowed: {rules[field.name].allowed}", place=f"{function}: settings.{field.name}"
        )
        for field in fields(settings)
        if (wrong := rules[field.name].fault(getattr(settings, field.name)))
    ]
    if errors:
        raise errors[0] if len(errors) == 1 else GroupedError(errors)
