"""The sheet of an object: its levels of detail, with the errors that scene.json gives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from paradize.files import bytes_text
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.scene.manifest import map_sets, read_entry
from paradize.metrics.texels import decode_texels
from paradize.preview.pictures import shown_level
from paradize.preview.shade import to_light
from paradize.report.lod_view import Shown, Skin, draw_levels

_TEXELS = 1024  # a side of the colour map as it is drawn


def draw_object(baked: Path, scene: dict[str, Any], item: dict[str, Any]) -> bytes:
    """A PNG of all levels of detail of an object of a scene.json, each with its triangles and errors."""
    entry = scene["artifacts"][item["mesh"]]
    lods = decode_glb(read_entry(baked, entry), entry["file"])
    skins = {"": Skin(None, Skin.color)}
    for any_of_them, names in map_sets(item):
        texels = None
        if any_of_them["maps"]["color"]:
            color = scene["artifacts"][any_of_them["maps"]["color"]]
            texture = decode_ktx2(read_entry(baked, color), color["file"])
            texels = decode_texels(texture, shown_level(texture, _TEXELS))
            texels = np.concatenate([to_light(texels[:, :, :3]), texels[:, :, 3:]], axis=2)
        for name in names:
            material = item["materials"][name]
            cutoff = material["alpha_cutoff"] if material["alpha_mode"] == "mask" else 0.0
            skins[name] = Skin(texels, tuple(material["color"]), cutoff)
    shown = [
        Shown(lod.mesh, _lines(k, lod.mesh, level["error_m"] / scene["lod_error_px"], measured))
        for k, (lod, level, measured) in enumerate(zip(lods, item["lods"], entry["levels"], strict=True))
    ]
    size = bytes_text(entry["bytes"])
    levels = "1 level" if len(shown) == 1 else f"{len(shown)} levels"
    return draw_levels(
        item["mesh"], f"{scene['name']}   -   {levels}, {size}, tier {entry['tier']}", shown, skins
    )


def _lines(level: int, mesh: Any, pixel_m: float, measured: dict[str, Any]) -> tuple[str, ...]:
    """The lines below the picture of a level. pixel_m: width of a pixel from which on it is drawn."""
    lines = [f"lod{level}: {len(mesh.triangles)} triangles"]
    if level:
        lines.append(f"drawn where a pixel covers {pixel_m:.2g} m or more")
        if "error_px" in measured:
            pixels = measured["error_px"]
            text = f"{pixels:.0f}" if pixels >= 10.0 else f"{pixels:.2g}"
            lines.append(f"{text} pixels at its nearest view")
        if "normal_mean_deg" in measured:
            lines.append(f"normals {measured['normal_mean_deg']:.2g} degrees off on average")
    else:
        lines.append("the source's surface")
    return tuple(lines)
