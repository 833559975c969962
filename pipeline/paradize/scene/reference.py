"""Writes FIELDS.md, every field of a scene with its default, unit, range and meaning, and an example of each
table; and scene.schema.json, the same for editors.

    python -m paradize.scene.reference

The texts come from the settings (settings/) and the metrics (budget.py). Only the examples are here.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from dataclasses import MISSING
from pathlib import Path
from typing import Any

from paradize.scene.budget import METRICS
from paradize.scene.json_schema import scene_schema
from paradize.scene.settings import Scene

PAGE = Path(__file__).with_name("FIELDS.md")
SCHEMA = Path(__file__).with_name("scene.schema.json")
_HEAD = """# The fields of a scene

A scene is one TOML file. A table is optional unless it says *Required*; a field whose default is *required*
must stand in its table. Files are named relative to the scene's folder and lie inside it. Metres, Y up, -Z
north, +X east; angles in degrees; colours are linear RGB. A wrong field is reported with its place, its
value and what is allowed.

This page is made from `settings/` by `python -m paradize.scene.reference`.
"""

# One example for each table. Together they are a valid scene (a test reads it).
EXAMPLES = {
    "scene": '[scene]\nname = "lagoon"\nviewport = [1920, 1080]\ntier = "auto"',
    "sun": "[sun]\nazimuth_deg = 215.0\nelevation_deg = 38.0",
    "ambient": "[ambient]\nintensity = 0.4",
    "fog": "[fog]\ndensity_per_m = 0.001",
    "wind": "[wind]\nazimuth_deg = 265.0\nspeed_m_per_s = 5.0",
    "sky": '[sky]\nfaces = ["px.exr", "nx.exr", "py.exr", "ny.exr", "pz.exr", "nz.exr"]',
    "daytime": "[[daytime]]\nat_s = 0.0\nexposure = 0.9\n\n[[daytime]]\nat_s = 30.0\nexposure = 2.0",
    "daytime.sun": "[daytime.sun]\nazimuth_deg = 260.0\nelevation_deg = 4.0\nintensity = 2.0",
    "daytime.moon": "[daytime.moon]\nazimuth_deg = 120.0\nelevation_deg = 20.0",
    "daytime.ambient": "[daytime.ambient]\nintensity = 0.1",
    "daytime.fog": "[daytime.fog]\ncolor = [0.6, 0.4, 0.3]",
    "moon": "[moon]\nangular_diameter_deg = 1.2",
    "clouds": '[clouds]\npicture = "clouds.png"\nhigh_deg = 24.0\nrepeat = 3\ndrift_repeats = 1',
    "shadow": "[shadow]\nextent_m = 60.0\ncenter = [0.0, 1.0, 0.0]",
    "light_shafts": "[light_shafts]\ndensity_per_m = 0.02\nrange_m = 30.0",
    "reflection": "[reflection]\nscale = 0.5",
    "refraction": "[refraction]\nscale = 0.5",
    "terrain": '[terrain]\nheightmap = "ground.png"\nsize_m = [200.0, 200.0]\nheight_m = 20.0\n'
    'base_m = -8.0\nsand_color = "sand.png"\nsand_repeat = 40.0',
    "terrain.sand_relief": "[terrain.sand_relief]\ncontrast = 1.5",
    "terrain.effect_relief": "[terrain.effect_relief]\ninvert = true",
    "water": '[water]\nwaves = "waves.png"\nlevel_m = 0.0\nsize_m = 2000.0',
    "water.wave_relief": '[water.wave_relief]\nfilter = "scharr"',
    "object": '[[object]]\nname = "palm"\nmesh = "palm.obj"\nlods = 4\nstrength = 0.5',
    "object.relief": "[object.relief]\ngamma = 0.8",
    "object.motion": "[object.motion]\nlaps = 18\nradius_m = [15.0, 10.0]\nbank_deg = 16.0",
    "object.motion.beat": "[object.motion.beat]\nper_lap = 34\nhinge_m = 0.06\nlift_deg = 30.0",
    "object.material": "[object.material.leaf]\nalpha_cutoff = 0.5\ntwo_sided = true",
    "object.instance": "[[object.instance]]\nposition = [3.0, 1.2, -4.0]\nyaw_deg = 30.0\n"
    "roll_deg = -5.0\nscale = [-1.0, 1.2, 1.0]",
    "light": '[[light]]\nname = "lamp"\nposition = [0.0, 2.4, 0.0]\nintensity = 4.0\nrange_m = 8.0\n'
    "on_s = 40.0\noff_s = 55.0",
    "particles": '[[particles]]\nname = "glitter"\ncenter = [0.0, 4.0, 0.0]\ncount = 100',
    "sound": '[[sound]]\nname = "sea"\nfile = "sea.ogg"\nvolume = 0.8\n\n[[sound]]\nname = "shore"\n'
    'file = "shore.ogg"\nline = [[-20.0, 0.0, 5.0], [0.0, 0.0, 8.0], [25.0, 0.0, 2.0]]\nradius_m = 4.0\n'
    "falloff = 0.7",
    "music": '[music]\nfiles = ["morning.ogg", "night.ogg"]\nvolume = 0.3',
    "flight": "[flight]\nduration_s = 60.0\nfov_deg = 45.0",
    "flight.eye": "[[flight.eye]]\nposition = [0.0, 2.0, 30.0]\n\n[[flight.eye]]\n"
    "position = [30.0, 5.0, 0.0]\nspeed = 0.5\n\n[[flight.eye]]\nposition = [-30.0, 3.0, 0.0]",
    "flight.target": "[[flight.target]]\nposition = [0.0, 1.0, 0.0]\n\n[[flight.target]]\n"
    "position = [0.0, 2.0, 0.0]\n\n[[flight.target]]\nposition = [0.0, 1.0, 0.0]",
    "free_camera": "[free_camera]\nlow = [-50.0, 1.0, -50.0]\nhigh = [50.0, 20.0, 50.0]",
    "budget": "[budget]\nnormal_p99_deg = 3.0\ncolor_psnr_db = { soft = 40.0, hard = 36.0 }",
    "check": '[check]\nPZ232 = "off"',
    "waiver": '[[waiver]]\nrule = "PZ401"\nartifact = "palm_color"\nmetric = "color_psnr_db"\n'
    'reason = "new leaves come in June"\nuntil = 2026-06-30',
}


def fields_page() -> str:
    """The text of FIELDS.md."""
    parts = [_HEAD]
    for path, field in _tables(Scene, ""):
        needed = field.default is MISSING and field.default_factory is MISSING
        parts.append(
            f"\n## `{_header(path)}`\n\n{field.metadata['meaning']}{' *Required.*' if needed else ''}\n"
        )
        if field.metadata["of"] is not None:
            parts.append(
                "\n| field | default | allowed | unit | meaning |\n| --- | --- | --- | --- | --- |\n"
            )
            own = dataclasses.fields(field.metadata["of"])
            parts += [_row(item) for item in own if item.metadata["of"] is None]
        else:
            parts.append(f"\nEach line: `{field.metadata['allowed']}`.\n")
        if path == "budget":
            parts.append("\n| metric | unit | limits | meaning |\n| --- | --- | --- | --- |\n")
            for name, limit in METRICS.items():
                limits = "at most" if limit.less_is_better else "at least"
                parts.append(f"| `{name}` | {limit.unit} | {limits} | {limit.meaning} |\n")
        parts.append(f"\n```toml\n{EXAMPLES[path]}\n```\n")
    return "".join(parts)


def schema_text() -> str:
    """The text of scene.schema.json."""
    return json.dumps(scene_schema(), indent=0, allow_nan=False) + "\n"


def _tables(of: type, path: str) -> Iterator[tuple[str, Any]]:
    """Yields every table of a dataclass and of its tables, by its path in the file."""
    for item in dataclasses.fields(of):
        key = item.metadata["key"] or item.name
        inner = item.metadata["of"]
        if inner is not None or of is Scene:
            yield f"{path}{key}", item
        if inner is not None:
            yield from _tables(inner, f"{path}{key}.")


def _header(path: str) -> str:
    """Returns the header of a table as its example writes it. Raises LookupError where it has none."""
    if path not in EXAMPLES:
        raise LookupError(f"the table {path!r} has no example; add one to EXAMPLES of scene/reference.py")
    return EXAMPLES[path].partition("\n")[0].replace(".leaf]", ".NAME]")


def _row(field: Any) -> str:
    facts = field.metadata
    return (
        f"| `{facts['key'] or field.name}` | {_default(field)} | {facts['allowed']} | {facts['unit']} | "
        f"{facts['meaning']} |\n"
    )


def _default(field: Any) -> str:
    if field.default is MISSING and field.default_factory is MISSING:
        return "*required*"
    value = field.default
    if value is None or value == ():
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"{', '.join(str(item) for item in value)}"
    return f"{value:g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    PAGE.write_text(fields_page(), encoding="utf-8")
    SCHEMA.write_text(schema_text(), encoding="utf-8")
