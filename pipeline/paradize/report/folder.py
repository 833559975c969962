"""The sheets of a baked folder, drawn where something changed: a PNG for each material, object and sky."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from paradize.build.provenance import BakeReport
from paradize.documents import SCENE_FILE, read_json
from paradize.errors import FormatError, ParadizeError
from paradize.files import read_file
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.scene_manifest import read_entry, read_scene
from paradize.maps import MAPS
from paradize.preview.pictures import MaterialDefaults, SheetMap
from paradize.report.levels import draw_object
from paradize.report.sheet import SHEET_ORDER, draw_sheet, draw_sky
from paradize.store.atomic import write_whole

RECORD = "sheets.json"
MOST_SHEETS = 100  # on a page


@dataclass
class Sheets:
    """What was done. drawn: files written now; left: how many more were to draw; warnings: sheets that could
    not be drawn, and why."""

    drawn: list[Path] = field(default_factory=list)
    left: int = 0
    warnings: list[str] = field(default_factory=list)


def draw_folder(baked: Path, folder: Path, most: int = 50) -> Sheets:
    """Draws the sheets of the scene in `baked` into `folder`, as <material>.png; those whose maps, errors and
    code are those of the sheet that stands there are left. At most `most` are drawn: one takes half a second.
    Sheets of materials that are gone are removed.

    Never raises for a sheet that fails: it is told in the warnings, and the others are drawn.
    """
    done = Sheets()
    try:
        scene = read_json(baked / SCENE_FILE)
        known = _record(folder)
        record: dict[str, str] = {}
        materials = _materials(scene)
        code = b"".join(read_file(path) for path in sorted(Path(__file__).parent.glob("*.py")))
        for name, entries in materials.items():
            ground = _ground(scene, name)
            key = _key(code, scene["name"], entries, ground)
            path = folder / f"{name}.png"
            if known.get(name) == key and path.is_file():
                record[name] = key
                continue
            if len(done.drawn) >= most:
                done.left += 1
                continue
            if _attempt(done, name, partial(_draw, baked, scene, name, entries, ground), path):
                record[name] = key
        for name in known.keys() - record.keys():
            if name not in materials:
                for suffix in ("png", "jpg"):
                    (folder / f"{name}.{suffix}").unlink(missing_ok=True)
        if record != known:
            text = json.dumps(record, indent=1, sort_keys=True).encode()
            write_whole(folder / RECORD, text, durable=False)
    except (OSError, ValueError, KeyError, TypeError, ParadizeError) as error:
        done.warnings.append(f"no contact sheets in {folder}: {error}")
    return done


def draw_page(
    baked: Path,
    folder: Path,
    report: BakeReport,
    explained: dict[str, Any],
    copies: Sequence[Path] = (),
) -> Path:
    """Writes the page of the scene in `baked` as index.html into `folder`, where its sheets are, and also to
    `copies`. explained: as scene_page takes it. A tradeoff.json in the folder is drawn too."""
    from paradize.report.scene_page import scene_page

    scene = read_scene(baked / SCENE_FILE)
    sheets = [folder / f"{name}.png" for name in _materials(scene)]

    def page(trade: dict[str, Any] | None) -> str:
        return scene_page(
            scene,
            report.rows,
            explained,
            [path for path in sheets if path.is_file()][:MOST_SHEETS],
            seconds=report.seconds,
            warnings=report.warnings,
            trade=trade,
        )

    try:
        text = page(_trade(folder / "tradeoff.json"))
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        what = f"is not what paradize measure writes ({type(error).__name__}: {error})"
        report.warnings.append(f"{folder / 'tradeoff.json'}: {what}; measure again")
        text = page(None)
    for path in (folder / "index.html", *copies):
        write_whole(path, text.encode(), durable=False)
    return folder / "index.html"


def draw_maps(files: dict[str, bytes], title: str, told: dict[str, Any], folder: Path, tiles: bool) -> Sheets:
    """The sheet of what `paradize maps` made, as <title>.png. files: KTX2 by file name; told: its JSON."""
    done = Sheets()

    def draw() -> bytes:
        maps = {}
        for name in (name for name in SHEET_ORDER if name in told["maps"]):
            entry = told["maps"][name]
            data = files[Path(entry["file"]).name]
            errors = entry.get("errors") or {entry["metric"]: entry["error"]}
            texture = decode_ktx2(data, entry["file"])
            maps[name] = SheetMap(
                texture, len(data), str(entry.get("tier", "")), errors, entry.get("levels") or []
            )
        return draw_sheet(title, _subtitle("maps", maps), maps, MaterialDefaults(tiles))

    _attempt(done, title, draw, folder / f"{title}.png")
    return done


def _trade(path: Path) -> dict[str, Any] | None:
    """What `measure` wrote, where it did. Raises ValueError where that cannot be read."""
    try:
        told: dict[str, Any] = read_json(path)
    except FileNotFoundError:
        return None
    except (OSError, FormatError) as error:
        raise ValueError(getattr(error, "strerror", None) or str(error)) from None
    return told


def _attempt(done: Sheets, name: str, draw: Callable[[], bytes], path: Path) -> bool:
    try:
        write_whole(path, draw(), durable=False)
    except Exception as error:  # a picture for the eye: whatever is wrong with it, the bake stands
        done.warnings.append(f"contact sheet {name}: {type(error).__name__}: {error}")
        return False
    done.drawn.append(path)
    return True


def _record(folder: Path) -> dict[str, str]:
    try:
        known = read_json(folder / RECORD)
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}


def _materials(scene: dict[str, Any]) -> dict[str, dict[str, dict[str, Any]]]:
    """Material -> map -> its artifact's entry, from names <material>_<map>; a cube map stands alone."""
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for name, entry in scene["artifacts"].items():
        material, _, kind = name.rpartition("_")
        if entry["kind"] == "texture" and kind in MAPS and material:
            found.setdefault(material, {})[kind] = entry
        elif entry["kind"] == "cubemap":
            found[name] = {"cubemap": entry}
    order = (*SHEET_ORDER, "cubemap")
    materials = {name: {k: maps[k] for k in order if k in maps} for name, maps in found.items()}
    for item in scene.get("objects", ()):
        color = {"color": scene["artifacts"][item["color"]]} if item["color"] else {}
        materials[item["mesh"]] = {"mesh": scene["artifacts"][item["mesh"]], **color}
    return materials


def _ground(scene: dict[str, Any], name: str) -> MaterialDefaults:
    """How a material lies and what it is where it has no map, as the scene says."""
    terrain, water = scene.get("terrain"), scene.get("water")
    if terrain and terrain.get("sand_color") == f"{name}_color":
        return MaterialDefaults(True, specular=terrain["specular"], smoothness=terrain["smoothness"])
    if terrain and terrain.get("effect_color") == f"{name}_color":
        return MaterialDefaults(False, specular=terrain["specular"], smoothness=terrain["smoothness"])
    if water and water.get("normal") == f"{name}_normal":
        deep, shallow = water["deep_color"], water["shallow_color"]
        color = tuple(0.7 * a + 0.3 * b for a, b in zip(deep, shallow, strict=True))
        return MaterialDefaults(True, (color[0], color[1], color[2]), water["specular"], water["smoothness"])
    for item in scene.get("objects", ()):
        if item.get("normal") == f"{name}_normal" or item.get("color") == f"{name}_color":
            material = next(iter(item["materials"].values()), None)
            if material:
                r, g, b = material["color"]
                return MaterialDefaults(False, (r, g, b), material["specular"], material["smoothness"])
    return MaterialDefaults()


def _key(code: bytes, scene: str, entries: dict[str, dict[str, Any]], ground: MaterialDefaults) -> str:
    told = json.dumps([scene, entries, repr(ground)], sort_keys=True).encode()
    return hashlib.sha256(hashlib.sha256(code).digest() + told).hexdigest()


def _draw(
    baked: Path,
    scene: dict[str, Any],
    name: str,
    entries: dict[str, dict[str, Any]],
    ground: MaterialDefaults,
) -> bytes:
    if "mesh" in entries:
        item = next(item for item in scene["objects"] if item["mesh"] == name)
        return draw_object(baked, scene, item)
    maps = {}
    for kind, entry in entries.items():
        texture = decode_ktx2(read_entry(baked, entry), entry["file"])
        maps[kind] = SheetMap(
            texture, entry["bytes"], entry["tier"], entry["errors"], entry.get("levels") or []
        )
    subtitle = _subtitle(scene["name"], maps)
    if "cubemap" in maps:
        return draw_sky(name, subtitle, maps["cubemap"], scene["exposure"])
    return draw_sheet(name, subtitle, maps, ground)


def _subtitle(scene: str, maps: dict[str, SheetMap]) -> str:
    total = sum(entry.bytes for entry in maps.values())
    largest = max(max(entry.texture.width, entry.texture.height) for entry in maps.values())
    what = "1 map" if len(maps) == 1 else f"{len(maps)} maps"
    told = f"{total / (1 << 20):.1f} MiB" if total >= 1 << 19 else f"{total / 1024:.1f} KiB"
    return f"{scene}   -   {what}, up to {largest} texels a side, {told} with all mips"
