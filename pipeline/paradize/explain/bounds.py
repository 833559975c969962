"""What each baked artifact does to a picture of the flight at most, with the terms of that, from scene.json
alone: what `paradize explain` calls its bound.

"At most" is said of bounds only. What is known by samples, and what light and parallax make of an error, is
named as not bounded instead of a number.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from paradize.explain.bound import SIX, bound
from paradize.maps import MAPS, maps_of

# What mixing linear light adds to the largest error of sRGB codes: a share of it, and a share of the range.
MIXED, MIXED_MOST = 0.32, 1.25 / 255.0


def bounds_of(manifest: dict[str, Any], folder: Path) -> dict[str, dict[str, Any]]:
    """By artifact {"value", "unit", "what", "terms", "open"}: `what` ("a pixel", "a texel") is off by no more
    than `value` of `unit` ("px", "codes" of 255, "degrees", "%"), None where nothing bounds it; terms: what
    makes up the value, each {"name", "value", "unit", ...}; open: what is not bounded, in words. Of the
    player's quality `balanced`; the term "quality fast" tells that of the other."""
    from paradize.explain.pixels import Camera  # these know numpy
    from paradize.explain.surfaces import mesh_bound, terrain_bounds

    camera = Camera(manifest)
    found = {item["mesh"]: mesh_bound(manifest, folder, item, camera) for item in manifest["objects"]}
    if manifest["terrain"]:
        found |= terrain_bounds(manifest, folder, camera)
    deep = {
        item[key]
        for item in manifest["objects"]
        for key in maps_of("object")
        if item["height"] is not None
        and any(material["parallax_scale"] != 0.0 for material in item["materials"].values())
    }
    for name, entry in manifest["artifacts"].items():
        if entry["kind"] == "texture":
            found[name] = _texture(name.rpartition("_")[2], entry, moved=name in deep)
        elif entry["kind"] == "cubemap":
            found[name] = _sky(entry)
        elif entry["kind"] == "sound":
            found[name] = bound(0.0, "codes", "a sample", [])
    return found


def mixed(share: float) -> float:
    """How far the code of a mix of texels is off at most, of the range, where no texel's sRGB code is off by
    more than `share`. Samplers mix linear light with weights that sum to one; a code's error stays what it is
    where the curve is a power (Minkowski's inequality), and grows by a little where dark texels on its
    straight foot are among them: MIXED and MIXED_MOST, which a test holds to the worst mixes that there are
    (of two texels, since means of points on a curve in a plane fill its convex hull)."""
    return min(1.0, share + min(MIXED * share, MIXED_MOST))


def _texture(key: str, entry: dict[str, Any], *, moved: bool) -> dict[str, Any]:
    last = entry["max_level"]
    levels = entry["levels"] if last is None else entry["levels"][: last + 1]
    measure = MAPS[key].worst
    unbounded = list(MAPS[key].not_bounded)
    if moved and key != "height":
        unbounded.insert(0, "where parallax moves its samples")
    gutter = entry["gutter"]
    if gutter is not None and key in ("normal", "gloss"):
        unbounded.insert(0, "texels at the borders of islands")
    if gutter is not None and gutter["islands"] > 1:
        worst = max(gutter["bleed_max"][: len(levels)], default=0.0)
        unbounded.append(
            f"what islands bleed into each other (the largest of the samples: {worst:.3g} of the range)"
        )
    if any("alpha_psnr_db" in level for level in levels):
        unbounded.append("alpha (of which the PSNR is known)")
    left_out = entry["asked"]["left_out"] if entry["asked"] else 0
    if left_out:
        unbounded.append(
            "triangles that show a line or a point of it (they may ask for levels that are left out)"
        )
    unit = "degrees" if measure == "max_deg" else "codes"
    if not levels or any(measure not in level for level in levels):
        return bound(None, unit, "a texel", [], ["its texels", *unbounded])
    scale = SIX if measure == "max_deg" else 255.0 * SIX
    worst_level = max(range(len(levels)), key=lambda at: levels[at][measure])
    value = levels[worst_level][measure] * scale
    terms = [{"name": f"level {worst_level}, a texel", "value": value, "unit": unit}]
    if measure == "max_deg":
        opened = entry["errors"].get("normal_open_max_deg", 0.0) if key == "normal" else None
        if opened is None or opened > 0.0:
            more = "" if opened is None else f" (at most {opened:.3g} degrees at level 0)"
            unbounded.insert(0, f"what half steps of its source's codes leave open{more}")
        return bound(value, unit, "a texel", terms, unbounded)
    if key == "color":
        whole = 255.0 * mixed(value / 255.0)
        terms.append({"name": "mixing in linear light", "value": whole - value, "unit": unit})
        value = whole
    if key == "gloss":
        unbounded.insert(0, "smoothness within what its source's codes leave open")
    if left_out:
        plural = "levels are" if left_out > 1 else "level is"
        told = f"{left_out} finer {plural} left out, which no pixel samples:"
        terms.append({"name": told, "value": 0.0, "unit": unit})
    return bound(value, unit, "a pixel", terms, unbounded)


def _sky(entry: dict[str, Any]) -> dict[str, Any]:
    error = entry["errors"].get("sky_max_relative")
    value = None if error is None else 100.0 * error * SIX
    unbounded = ["its coarser levels, which rough mirrors show"]
    return bound(value, "%", "a texel's light", [], unbounded)


def bound_words(told: dict[str, Any]) -> str:
    """The same in one line."""
    if told["what"] == "a sample":
        return "its bytes are those of its source"
    if told["value"] is None:
        line = f"no bound of what it does to {told['what']}"
    elif told["unit"] == "px":
        line = f"no pixel of the flight moves by more than {_up(told['value'])} px because of it"
    else:
        unit = "codes of 255" if told["unit"] == "codes" else told["unit"]
        line = f"{told['what']} is off by at most {_up(told['value'])} {unit} because of it"
    parts = [_term_words(term) for term in told["terms"]]
    if parts:
        line += f": {'; '.join(parts)}"
    if told["open"]:
        line += f". Not bounded: {', '.join(told['open'])}"
    return line


def _term_words(term: dict[str, Any]) -> str:
    value = "unbounded" if term["value"] is None else f"{_up(term['value'])} {term['unit']}"
    parts = term.get("parts", {}).items()
    more = [f"{name} {_up(part) if part >= 0.001 else 'under 0.001'}" for name, part in parts]
    if "error_m" in term:
        more.append(f"{_up(term['error_m'])} m off")
    if "away_m" in term:
        when = "for the free camera" if term["second_s"] is None else f"at second {term['second_s']:g}"
        more.append(f"{term['away_m']:.3g} m away or more {when}")
    return f"{term['name']} {value}" + (f" ({', '.join(more)})" if more else "")


def _up(value: float) -> str:
    """A number of three digits, not below `value`; what is below a thousandth counts as that."""
    if 0.0 < value < 0.001:
        return "0.001"
    text = f"{value:.3g}"
    if float(text) < value * (1.0 - 1e-9):
        text = f"{float(text) + 10.0 ** (math.floor(math.log10(value)) - 2):.3g}"
    return text
