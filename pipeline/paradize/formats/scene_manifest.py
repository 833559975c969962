"""scene.json: everything the player needs to know of a baked scene (see FORMAT.md).

Encoding is canonical (same content, same bytes): one top-level key a line, floats as the shortest decimal
that reads back the same. Decoding refuses what it does not know: another format or version, unknown keys,
missing keys, wrong types, NaN, names of artifacts that the manifest does not hold.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from paradize.errors import FormatError

FORMAT = "paradize-scene"
VERSION = 1
KINDS = ("mesh", "texture", "cubemap", "sound")

Check = Callable[[Any, str], None]  # value, key path; raises _Wrong


class _Wrong(Exception):  # noqa: N818 (never leaves this module)
    def __init__(self, place: str, what: str) -> None:
        super().__init__(what)
        self.place = place


def _number(low: float = -1e30, high: float = 1e30) -> Check:
    def check(value: Any, place: str) -> None:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise _Wrong(place, f"is {value!r:.60}, not a number in {low:g} to {high:g}")

    return check


def _whole(low: int, high: int) -> Check:
    def check(value: Any, place: str) -> None:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise _Wrong(place, f"is {value!r:.60}, not a whole number in {low} to {high}")

    return check


def _text(value: Any, place: str) -> None:
    if not isinstance(value, str) or not value:
        raise _Wrong(place, f"is {value!r:.60}, not a name")


def _file(value: Any, place: str) -> None:
    _text(value, place)
    if "/" in value or "\\" in value or value.startswith("."):
        raise _Wrong(place, f"is {value!r:.60}, not a file name in the manifest's own folder")


def _hash(value: Any, place: str) -> None:
    if not isinstance(value, str) or len(value) != 64 or set(value) - set("0123456789abcdef"):
        raise _Wrong(place, f"is {value!r:.80}, not a SHA-256")


def _flag(value: Any, place: str) -> None:
    if not isinstance(value, bool):
        raise _Wrong(place, f"is {value!r:.60}, not true or false")


def _kind(value: Any, place: str) -> None:
    if value not in KINDS:
        raise _Wrong(place, f"is {value!r:.60}, not one of {', '.join(KINDS)}")


def _list(item: Check, *, size: int | None = None, least: int = 0) -> Check:
    def check(value: Any, place: str) -> None:
        if not isinstance(value, list) or len(value) < least or (size is not None and len(value) != size):
            wanted = f"{size}" if size is not None else f"at least {least}"
            raise _Wrong(place, f"is not a list of {wanted}")
        for i, part in enumerate(value):
            item(part, f"{place}[{i}]")

    return check


def _map(item: Check) -> Check:
    def check(value: Any, place: str) -> None:
        if not isinstance(value, dict):
            raise _Wrong(place, "is not an object")
        for key, part in value.items():
            item(part, f"{place}.{key}")

    return check


def _table(**keys: Check) -> Check:
    def check(value: Any, place: str) -> None:
        if not isinstance(value, dict):
            raise _Wrong(place, "is not an object")
        dotted = f"{place}." if place else ""
        for key in value:
            if key not in keys:
                raise _Wrong(f"{dotted}{key}", "is not a key that this version knows")
        for key, item in keys.items():
            if key not in value:
                raise _Wrong(f"{dotted}{key}", "is missing")
            item(value[key], f"{dotted}{key}")

    return check


def _or_null(item: Check) -> Check:
    def check(value: Any, place: str) -> None:
        if value is not None:
            item(value, place)

    return check


_real, _positive, _share = _number(), _number(0.0), _number(0.0, 1.0)
_vec2, _vec3 = _list(_real, size=2), _list(_real, size=3)
_cubic = _list(_real, size=4)
_level = _whole(0, 31)
_view = _or_null(_table(scale=_number(1e-3, 16.0)))
_material = _table(
    color=_vec3,
    parallax_scale=_real,
    parallax_bias=_real,
    parallax_limit=_or_null(_positive),
    specular=_positive,
    smoothness=_share,
    two_sided=_flag,
    alpha_cutoff=_share,
)
_gutter = _table(
    islands=_whole(1, 1 << 31),
    needed_texels=_positive,
    width_texels=_or_null(_positive),
    level_in_use=_level,
    level_by_width=_whole(-1, 31),
    bound=_share,
    bleed_p99=_list(_positive, least=1),
    bleed_max=_list(_positive, least=1),
)

_manifest = _table(
    format=_text,
    version=_whole(1, 1 << 30),
    name=_text,
    exposure=_positive,
    viewport=_list(_whole(1, 1 << 20), size=2),
    lod_error_px=_positive,
    poster_s=_positive,
    artifacts=_map(
        _table(
            file=_file,
            kind=_kind,
            sha256=_hash,
            bytes=_whole(1, 1 << 60),
            tier=_text,
            errors=_map(_real),
            levels=_list(_map(_real)),
            first_needed_s=_positive,
            max_level=_or_null(_level),
            gutter=_or_null(_gutter),
        )
    ),
    streaming=_list(_text),
    budget=_map(_positive),
    sun=_table(direction=_vec3, color=_vec3, intensity=_positive, angular_diameter_rad=_positive),
    ambient=_table(color=_vec3, intensity=_positive),
    fog=_table(color=_vec3, density_per_m=_positive),
    sky=_or_null(_table(cubemap=_text)),
    shadow=_or_null(
        _table(size=_whole(1, 1 << 16), extent_m=_positive, center=_vec3, blur_distance_m=_positive)
    ),
    reflection=_view,
    refraction=_view,
    terrain=_or_null(
        _table(
            mesh=_text,
            sand_color=_text,
            sand_normal=_or_null(_text),
            effect_color=_or_null(_text),
            effect_normal=_or_null(_text),
            sand_repeat=_positive,
            mix_low_m=_real,
            mix_high_m=_real,
            specular=_positive,
            smoothness=_share,
            wet_high_m=_positive,
            wet_darkness=_share,
            wet_smoothness=_share,
            size_m=_vec2,
            height_range_m=_vec2,
        )
    ),
    water=_or_null(
        _table(
            normal=_text,
            dudv=_text,
            level_m=_real,
            size_m=_positive,
            tile=_positive,
            k=_positive,
            scroll_per_s=_vec2,
            strength=_positive,
            deep_color=_vec3,
            shallow_color=_vec3,
            absorption_per_m=_vec3,
            specular=_positive,
            smoothness=_share,
        )
    ),
    objects=_list(
        _table(
            name=_text,
            mesh=_text,
            color=_or_null(_text),
            normal=_or_null(_text),
            height=_or_null(_text),
            gloss=_or_null(_text),
            repeat=_flag,
            center=_vec3,
            radius_m=_positive,
            lods=_list(_table(node=_text, error_m=_positive), least=1),
            materials=_map(_material),
            instances=_list(_table(position=_vec3, yaw_rad=_real, scale=_positive), least=1),
        )
    ),
    particles=_list(
        _table(
            name=_text,
            center=_vec3,
            radius_m=_positive,
            count=_whole(1, 1 << 30),
            size_m=_vec2,
            life_per_s=_vec2,
            threshold=_share,
            color=_vec3,
        )
    ),
    sound=_or_null(_table(artifact=_text, volume=_share)),
    flight=_table(
        duration_s=_number(1e-3),
        fov_rad=_number(1e-3, 3.2),
        near_m=_number(1e-9),
        far_m=_number(1e-9),
        segments=_list(_table(eye=_list(_cubic, size=3), target=_list(_cubic, size=3), roll=_cubic), least=1),
        time_table=_list(_list(_real, size=3), least=2),
        waypoint_u=_list(_whole(0, 1 << 30), least=1),
        errors=_map(_real),
    ),
)


def references(manifest: dict[str, Any]) -> list[tuple[str, str, tuple[str, ...]]]:
    """(place, artifact name, kinds that may stand there) of everything that the manifest refers to."""
    found: list[tuple[str, str | None, tuple[str, ...]]] = []
    for i, name in enumerate(manifest["streaming"]):
        found.append((f"streaming[{i}]", name, KINDS))
    if manifest["sky"]:
        found.append(("sky.cubemap", manifest["sky"]["cubemap"], ("cubemap",)))
    if terrain := manifest["terrain"]:
        found.append(("terrain.mesh", terrain["mesh"], ("mesh",)))
        for key in ("sand_color", "sand_normal", "effect_color", "effect_normal"):
            found.append((f"terrain.{key}", terrain[key], ("texture",)))
    if water := manifest["water"]:
        found += [(f"water.{key}", water[key], ("texture",)) for key in ("normal", "dudv")]
    for i, item in enumerate(manifest["objects"]):
        found.append((f"objects[{i}].mesh", item["mesh"], ("mesh",)))
        for key in ("color", "normal", "height", "gloss"):
            found.append((f"objects[{i}].{key}", item[key], ("texture",)))
    if manifest["sound"]:
        found.append(("sound.artifact", manifest["sound"]["artifact"], ("sound",)))
    return [(place, name, kinds) for place, name, kinds in found if name is not None]


def _time_table(manifest: dict[str, Any]) -> None:
    flight = manifest["flight"]
    table = flight["time_table"]
    for i in range(1, len(table)):
        if not table[i][0] > table[i - 1][0] or not table[i][1] > table[i - 1][1]:
            raise _Wrong(f"flight.time_table[{i}]", "does not go forward in time and along the path")
    ends = (table[0][0], table[0][1], table[-1][0], table[-1][1])
    if ends != (0, 0, flight["duration_s"], len(flight["segments"])):
        raise _Wrong("flight.time_table", "does not go from (0, 0) to (duration_s, number of segments)")


def encode_scene(manifest: dict[str, Any]) -> bytes:
    """The bytes of scene.json. Raises FormatError where the manifest is not what version 1 says."""
    _validate(manifest, "scene.json")
    lines = [
        f"{json.dumps(key)}: {json.dumps(value, separators=(',', ':'), ensure_ascii=False, allow_nan=False)}"
        for key, value in manifest.items()
    ]
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()


def decode_scene(data: bytes, file: object = "scene.json") -> dict[str, Any]:
    """The manifest in the bytes of a scene.json, validated. Raises FormatError (file, key path, value)."""

    def refuse(name: str) -> float:
        raise ValueError(f"{name} is not a number")

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        result = dict(pairs)
        if len(result) != len(pairs):
            raise ValueError("an object holds a key twice")
        return result

    try:
        manifest = json.loads(data.decode("utf-8"), parse_constant=refuse, object_pairs_hook=unique)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"is not JSON: {error}", file=file) from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise FormatError(f"is not a baked scene: its format is not {FORMAT!r}", file=file)
    if manifest.get("version") != VERSION:
        version = manifest.get("version")
        raise FormatError(
            f"is {version!r}; this Paradize reads {VERSION}", file=file, place="version", mend="bake it again"
        )
    _validate(manifest, file)
    return manifest


def _validate(manifest: dict[str, Any], file: object) -> None:
    try:
        _manifest(manifest, "")
        for place, name, kinds in references(manifest):
            artifact = manifest["artifacts"].get(name)
            if artifact is None:
                raise _Wrong(place, f"names {name!r}, which is no artifact here")
            if artifact["kind"] not in kinds:
                raise _Wrong(place, f"names {name!r}, a {artifact['kind']}, not a {' or '.join(kinds)}")
        _time_table(manifest)
    except _Wrong as wrong:
        raise FormatError(str(wrong), file=file, place=wrong.place or None) from None
