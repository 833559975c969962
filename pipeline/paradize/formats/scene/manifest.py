"""Reads and writes scene.json, the description of a baked scene for the player (see ../FORMAT.md).

The encoding is canonical: equal content gives equal bytes, with one top-level key per line and floats in
their shortest exact form. Decoding refuses other formats and versions, unknown and missing keys, wrong types,
NaN, and names of artifacts that are not in the manifest.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from paradize.documents import JSON_BYTES, json_kind, parse_json
from paradize.errors import FormatError
from paradize.files import read_file
from paradize.formats.scene.fields import Wrong
from paradize.formats.scene.schema import GROUND_MAPS, KINDS, MANIFEST
from paradize.formats.scene.terrain_tables import check_tree
from paradize.map_table import maps_of
from paradize.material import REPEATED

FORMAT = "paradize-scene"
VERSION = 10


def references(manifest: dict[str, Any]) -> list[tuple[str, str, tuple[str, ...]]]:
    """(key path, artifact name, allowed kinds) of each artifact that the manifest refers to."""
    entries: list[tuple[str, str | None, tuple[str, ...]]] = []
    for i, name in enumerate(manifest["streaming"]):
        entries.append((f"streaming[{i}]", name, KINDS))
    if manifest["sky"]:
        entries.append(("sky.cubemap", manifest["sky"]["cubemap"], ("cubemap",)))
    if daytime := manifest["daytime"]:
        for i, key in enumerate(daytime["keys"]):
            entries.append((f"daytime.keys[{i}].cubemap", key["cubemap"], ("cubemap",)))
        if daytime["clouds"]:
            entries.append(("daytime.clouds.color", daytime["clouds"]["color"], ("texture",)))
    if terrain := manifest["terrain"]:
        entries += [(f"terrain.tiles[{i}]", name, ("mesh",)) for i, name in enumerate(terrain["tiles"])]
        for key in GROUND_MAPS:
            entries.append((f"terrain.{key}", terrain[key], ("texture",)))
    if water := manifest["water"]:
        entries += [(f"water.{key}", water[key], ("texture",)) for key in maps_of("water")]
    for i, item in enumerate(manifest["objects"]):
        entries.append((f"objects[{i}].mesh", item["mesh"], ("mesh",)))
        for material, values in item["materials"].items():
            for place, maps in maps_of_material(values).items():
                for key, name in maps.items():
                    at = f"objects[{i}].materials.{material}.{place}.{key}"
                    entries.append((at, name, ("texture",)))
    for i, sound in enumerate(manifest["sounds"]):
        entries.append((f"sounds[{i}].artifact", sound["artifact"], ("sound",)))
    for i, name in enumerate(manifest["music"]["artifacts"] if manifest["music"] else ()):
        entries.append((f"music.artifacts[{i}]", name, ("sound",)))
    return [(place, name, kinds) for place, name, kinds in entries if name is not None]


def maps_of_material(material: dict[str, Any]) -> dict[str, dict[str, str | None]]:
    """The maps of a material by their place in its entry: on first texture coordinates, on second ones."""
    second = {"second.maps": material["second"]["maps"]} if "second" in material else {}
    return {"maps": material["maps"], **second}


def repeats(material: dict[str, Any]) -> bool:
    """Whether the maps of a material repeat along both axes."""
    return bool(material["wrap"] == list(REPEATED))


def map_sets(item: dict[str, Any]) -> list[tuple[dict[str, Any], frozenset[str]]]:
    """The materials of an entry of `objects` that have the same maps, used alike: one of them, and the names
    of all."""
    sets: dict[tuple[Any, ...], tuple[dict[str, Any], frozenset[str]]] = {}
    for name, material in item["materials"].items():
        key = (*material["maps"].values(), *(material["wrap"] or ()))
        first, names = sets.get(key, (material, frozenset()))
        sets[key] = first, names | {name}
    return list(sets.values())


def _time_table(manifest: dict[str, Any]) -> None:
    flight = manifest["flight"]
    table = flight["time_table"]
    for i in range(1, len(table)):
        if not table[i][0] > table[i - 1][0] or not table[i][1] > table[i - 1][1]:
            raise Wrong(f"flight.time_table[{i}]", "does not go forward in time and along the path")
    ends = (table[0][0], table[0][1], table[-1][0], table[-1][1])
    if ends != (0, 0, flight["duration_s"], len(flight["segments"])):
        raise Wrong("flight.time_table", "does not go from (0, 0) to (duration_s, number of segments)")


_NO_LIGHT: dict[str, Any] = {"lights": [], "glow": None}  # the first of `light_sets`


def _check_light_sets(manifest: dict[str, Any]) -> None:
    """Raises Wrong for a light or a set that is not there, and for a list of the wrong length."""
    lights, sets = len(manifest.get("lights", ())), manifest.get("light_sets", [_NO_LIGHT])
    for i, light_set in enumerate(sets):
        named = [*light_set["lights"], *([] if light_set["glow"] is None else [light_set["glow"]])]
        if max(named, default=-1) >= lights or light_set["lights"] != sorted(set(light_set["lights"])):
            raise Wrong(
                f"light_sets[{i}]", f"is {light_set!r:.60}; there are {lights} lights, and they must rise"
            )
    if sets[0] != _NO_LIGHT:
        raise Wrong("light_sets[0]", "must be empty: no light")
    terrain, water = manifest["terrain"], manifest["water"]
    owners = [
        (f"objects[{i}].light_sets", item["light_sets"], len(item["instances"]))
        for i, item in enumerate(manifest["objects"])
        if "light_sets" in item
    ]
    if terrain and "light_sets" in terrain:
        owners.append(("terrain.light_sets", terrain["light_sets"], len(terrain["patches"]["tile"])))
    if water and "light_set" in water:
        owners.append(("water.light_set", [water["light_set"]], 1))
    for place, indices, count in owners:
        if len(indices) != count or max(indices) >= len(sets):
            what = f"{len(indices)} numbers up to {max(indices, default=0)}"
            raise Wrong(place, f"holds {what}; it must hold {count} below {len(sets)}")


def encode_scene(manifest: dict[str, Any]) -> bytes:
    """The bytes of scene.json. Raises FormatError for an invalid manifest or more than JSON_BYTES."""
    _validate(manifest, "scene.json")
    lines = [
        f"{json.dumps(key)}: {json.dumps(value, separators=(',', ':'), ensure_ascii=False, allow_nan=False)}"
        for key, value in manifest.items()
    ]
    data = ("{\n" + ",\n".join(lines) + "\n}\n").encode()
    if len(data) > JSON_BYTES:
        what = f"{len(data)} bytes, limit {JSON_BYTES}"
        raise FormatError(what, file="scene.json", mend="split the scene")
    return data


def decode_scene(data: bytes, file: object = "scene.json") -> dict[str, Any]:
    """The validated manifest of a scene.json. Raises FormatError (file, key path, value)."""

    manifest = parse_json(data, file)
    if not isinstance(manifest, dict):
        what = f"is not a baked scene: it holds {json_kind(manifest)}, not an object"
        raise FormatError(what, file=file, mend="bake it again")
    if manifest.get("format") != FORMAT:
        what = f"is not a baked scene: its format is not {FORMAT!r}"
        raise FormatError(what, file=file, mend="bake it again")
    if manifest.get("version") != VERSION:
        version = manifest.get("version")
        raise FormatError(
            f"is {version!r}; this Paradize reads {VERSION}", file=file, place="version", mend="bake it again"
        )
    _validate(manifest, file)
    return manifest


def read_scene(path: Path) -> dict[str, Any]:
    """Reads a scene.json of at most JSON_BYTES. Raises OSError as `open_file` and FormatError as
    `decode_scene`."""
    return decode_scene(read_file(path, JSON_BYTES), path)


def read_entry(folder: Path, entry: dict[str, Any]) -> bytes:
    """Reads the file of an entry of `artifacts` in `folder`. Raises OSError as `open_file`, and where the
    file is larger than the entry says."""
    return read_file(folder / entry["file"], entry["bytes"])


def _validate(manifest: dict[str, Any], file: object) -> None:
    try:
        MANIFEST(manifest, "")
        for place, name, kinds in references(manifest):
            artifact = manifest["artifacts"].get(name)
            if artifact is None:
                raise Wrong(place, f"names {name!r}, which is not an artifact of this scene")
            if artifact["kind"] not in kinds:
                raise Wrong(place, f"names {name!r}, a {artifact['kind']}, not a {' or '.join(kinds)}")
        if manifest["terrain"]:
            check_tree(manifest["terrain"])
        _check_light_sets(manifest)
        _time_table(manifest)
    except Wrong as fault:
        raise FormatError(str(fault), file=file, place=fault.place or None) from None
