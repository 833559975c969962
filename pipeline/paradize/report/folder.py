"""The contact sheets of a baked folder, a PNG for each material, object and sky, and its page. A sheet is
drawn only if something changed."""

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
from paradize.files import bytes_text
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.scene.manifest import read_entry, read_scene
from paradize.jobs.code import code_digest
from paradize.map_table import MAPS
from paradize.preview.pictures import MaterialDefaults, SheetMap
from paradize.report.levels import draw_object
from paradize.report.poster import Poster
from paradize.report.sheet import SHEET_ORDER, draw_sheet, draw_sky
from paradize.store.atomic import write_report

RECORD = "sheets.json"
MOST_SHEETS = 100  # on a page


@dataclass
class Sheets:
    """drawn: the files written now; left: the number of sheets still to draw; warnings: sheets that could not
    be drawn, and why."""

    drawn: list[Path] = field(default_factory=list)
    left: int = 0
    warnings: list[str] = field(default_factory=list)


def draw_folder(
    baked: Path,
    folder: Path,
    most: int = 50,
    on_progress: Callable[[str, int, int], None] | None = None,
) -> Sheets:
    """Draws the sheets of the scene in `baked` into `folder`, as <material>.png. A sheet stays if
    what it shows and the code that draws it did not change. At most `most` are drawn, because one takes half
    a second. Sheets of materials that no longer exist are removed.

    Never raises for a sheet that fails: it becomes a warning, and the others are drawn.
    """
    sheets = Sheets()
    try:
        scene = read_json(baked / SCENE_FILE)
        known = _record(folder)
        record: dict[str, str] = {}
        materials = _materials(scene)
        code = code_digest("paradize.report.sheet") + code_digest("paradize.report.levels")
        for done, (name, entries) in enumerate(materials.items()):
            defaults = _material_defaults(scene, name)
            key = _key(code, scene, name, entries, defaults)
            path = folder / f"{name}.png"
            if known.get(name) == key and path.is_file():
                record[name] = key
                continue
            if len(sheets.drawn) >= most:
                sheets.left += 1
                continue
            if on_progress:
                on_progress(f"contact sheet {name}", done, len(materials))
            if _attempt(sheets, name, partial(_draw, baked, scene, name, entries, defaults), path):
                record[name] = key
        for name in known.keys() - record.keys():
            if name not in materials:
                for suffix in ("png", "jpg"):
                    (folder / f"{name}.{suffix}").unlink(missing_ok=True)
        if record != known:
            text = json.dumps(record, indent=1, sort_keys=True).encode()
            write_report(folder / RECORD, text)
    except (OSError, ValueError, KeyError, TypeError, ParadizeError) as error:
        sheets.warnings.append(f"no contact sheets in {folder}: {error}")
    return sheets


def draw_page(
    baked: Path,
    folder: Path,
    report: BakeReport,
    explained: dict[str, Any],
    poster: Poster,
    copies: Sequence[Path] = (),
) -> Path:
    """Writes the page of the scene in `baked` as index.html into `folder`, where its sheets are, and to
    `copies`. explained, poster: as scene_page takes them. A tradeoff.json in the folder is drawn too."""
    from paradize.report.scene_page import scene_page

    scene = read_scene(baked / SCENE_FILE)
    sheets = [folder / f"{name}.png" for name in _materials(scene)]

    def page(tradeoff: dict[str, Any] | None) -> str:
        return scene_page(
            scene,
            report.rows,
            explained,
            poster,
            [path for path in sheets if path.is_file()][:MOST_SHEETS],
            seconds=report.seconds,
            warnings=report.warnings,
            tradeoff=tradeoff,
        )

    try:
        text = page(_tradeoff(folder / "tradeoff.json"))
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        what = f"is not what paradize measure writes ({type(error).__name__}: {error})"
        report.warnings.append(f"{folder / 'tradeoff.json'}: {what}; measure again")
        text = page(None)
    for path in (folder / "index.html", *copies):
        write_report(path, text.encode())
    return folder / "index.html"


def draw_maps(
    files: dict[str, bytes], title: str, result: dict[str, Any], folder: Path, tiles: bool
) -> Sheets:
    """Draws the sheet of what `paradize maps` made, as <title>.png. files: KTX2 by file name; result: what
    `maps --json` prints; tiles: whether the maps repeat."""
    sheets = Sheets()

    def draw() -> bytes:
        maps = {}
        for name in (name for name in SHEET_ORDER if name in result["maps"]):
            entry = result["maps"][name]
            data = files[Path(entry["file"]).name]
            errors = entry.get("errors") or {entry["metric"]: entry["error"]}
            texture = decode_ktx2(data, entry["file"])
            maps[name] = SheetMap(
                texture, len(data), str(entry.get("tier", "")), errors, entry.get("levels") or []
            )
        return draw_sheet(title, _subtitle("maps", maps), maps, MaterialDefaults(tiles))

    _attempt(sheets, title, draw, folder / f"{title}.png")
    return sheets


def _tradeoff(path: Path) -> dict[str, Any] | None:
    """The tradeoff.json that `measure` wrote; None if there is none. Raises ValueError if it cannot be
    read."""
    try:
        tree: dict[str, Any] = read_json(path)
    except FileNotFoundError:
        return None
    except (OSError, FormatError) as error:
        raise ValueError(getattr(error, "strerror", None) or str(error)) from None
    return tree


def _attempt(sheets: Sheets, name: str, draw: Callable[[], bytes], path: Path) -> bool:
    """Draws one sheet and notes it in `sheets`; whether it was drawn."""
    try:
        write_report(path, draw())
    except Exception as error:  # the bake is good without the picture
        kind = "" if isinstance(error, ParadizeError) else f"{type(error).__name__}: "
        sheets.warnings.append(f"contact sheet {name}: {kind}{error}")
        return False
    sheets.drawn.append(path)
    return True


def _record(folder: Path) -> dict[str, str]:
    """The keys of the sheets in the folder, by name."""
    try:
        known = read_json(folder / RECORD)
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}


def _materials(scene: dict[str, Any]) -> dict[str, dict[str, dict[str, Any]]]:
    """Material -> map -> the artifact's entry, from names <material>_<map>. A cube map and an object's mesh
    are materials of their own."""
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
        names = sorted({material["maps"]["color"] for material in item["materials"].values()} - {None})
        color = {f"color {name}": scene["artifacts"][name] for name in names}
        materials[item["mesh"]] = {"mesh": scene["artifacts"][item["mesh"]], **color}
    return materials


def _material_defaults(scene: dict[str, Any], name: str) -> MaterialDefaults:
    """Whether a material repeats, and its values where it has no map, as the scene says."""
    clouds = (scene.get("daytime") or {}).get("clouds")
    if clouds and clouds["color"] == f"{name}_color":
        meaning = "red, green, blue: how bright light from the right, the left and above makes each texel"
        return MaterialDefaults(about=meaning)
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
        for material in item["materials"].values():
            maps = material["maps"]
            if maps["normal"] == f"{name}_normal" or maps["color"] == f"{name}_color":
                r, g, b = material["color"]
                return MaterialDefaults(False, (r, g, b), material["specular"], material["smoothness"])
    return MaterialDefaults()


def _key(
    code: str,
    scene: dict[str, Any],
    name: str,
    entries: dict[str, dict[str, Any]],
    defaults: MaterialDefaults,
) -> str:
    """The hash of what a sheet is drawn from. code: digests of the modules that draw it."""
    inputs: list[Any] = [code, scene["name"], entries]
    if "mesh" in entries:
        item = _object_of(scene, name)
        inputs += [scene["lod_error_px"], item["lods"], item["materials"]]
    elif "cubemap" in entries:
        inputs.append(scene["exposure"])
    else:
        inputs.append(repr(defaults))
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()


def _object_of(scene: dict[str, Any], mesh: str) -> dict[str, Any]:
    """The first object of a mesh."""
    found: dict[str, Any] = next(item for item in scene["objects"] if item["mesh"] == mesh)
    return found


def _draw(
    baked: Path,
    scene: dict[str, Any],
    name: str,
    entries: dict[str, dict[str, Any]],
    defaults: MaterialDefaults,
) -> bytes:
    """The sheet of one material, object or sky as PNG."""
    if "mesh" in entries:
        return draw_object(baked, scene, _object_of(scene, name))
    maps = {}
    for kind, entry in entries.items():
        texture = decode_ktx2(read_entry(baked, entry), entry["file"])
        maps[kind] = SheetMap(
            texture, entry["bytes"], entry["tier"], entry["errors"], entry.get("levels") or []
        )
    subtitle = _subtitle(scene["name"], maps)
    if "cubemap" in maps:
        return draw_sky(name, subtitle, maps["cubemap"], scene["exposure"])
    return draw_sheet(name, subtitle, maps, defaults)


def _subtitle(scene: str, maps: dict[str, SheetMap]) -> str:
    total = sum(entry.bytes for entry in maps.values())
    largest = max(max(entry.texture.width, entry.texture.height) for entry in maps.values())
    what = "1 map" if len(maps) == 1 else f"{len(maps)} maps"
    return f"{scene}   -   {what}, up to {largest} texels a side, {bytes_text(total)} with all mips"
