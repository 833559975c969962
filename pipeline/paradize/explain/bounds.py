"""The bound of each baked artifact: how much it changes a picture of the flight at most, with the terms of
the bound, from scene.json.

Sampled errors, and the effects of light and parallax on an error, have no bound. They are listed as not
bounded."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from paradize.explain.bound import SIX, bound
from paradize.map_table import MAPS

# Mixing linear light adds this to the largest error of sRGB values: a share of it, at most MIXED_MOST.
MIXED, MIXED_MOST = 0.32, 1.25 / 255.0


def bounds_of(
    manifest: dict[str, Any], folder: Path, artifact: str | None = None
) -> dict[str, dict[str, Any]]:
    """Artifact -> {"value", "unit", "what", "terms", "open"}. artifact: the one to bound, if
    not all. Other meshes and terrains, which take long, are then left out.

    `what` ("a pixel", "a texel") is off by at most `value` of `unit` ("px", "codes" of 255, "degrees", "%");
    None: no bound. terms: the parts of the value, each {"name", "value", "unit", ...}. open: what is not
    bounded, in words. Bounds are for the player's quality `balanced`; the term "at quality fast" is for the
    other."""
    from paradize.explain.pixels import Camera  # these know numpy
    from paradize.explain.surfaces import mesh_bound, terrain_bounds

    camera = Camera(manifest)
    bounds = {
        item["mesh"]: mesh_bound(manifest, folder, item, camera)
        for item in manifest["objects"]
        if artifact in (None, item["mesh"])
    }
    if manifest["terrain"] and (artifact is None or artifact in manifest["terrain"]["tiles"]):
        bounds |= terrain_bounds(manifest, folder, camera)
    parallax = {
        name
        for item in manifest["objects"]
        for material in item["materials"].values()
        if material["maps"]["height"] is not None and material["parallax_scale"] != 0.0
        for name in material["maps"].values()
    }
    for name, entry in manifest["artifacts"].items():
        if entry["kind"] == "texture":
            bounds[name] = _texture(name.rpartition("_")[2], entry, moved=name in parallax)
        elif entry["kind"] == "cubemap":
            bounds[name] = _sky(entry)
        elif entry["kind"] == "sound":
            bounds[name] = bound(0.0, "codes", "a sample", [])
    return bounds


def mixed(share: float) -> float:
    """The largest error of the sRGB value of a mix of texels, of the range, if no texel's value is off by
    more than `share`. Samplers mix linear light with weights that sum to one. Where the sRGB curve is a
    power, the error does not grow (Minkowski's inequality); on its straight foot it grows by MIXED, at most
    by MIXED_MOST. A test compares both with the worst mixes (of two texels: means of points on a plane curve
    fill its convex hull)."""
    return min(1.0, share + min(MIXED * share, MIXED_MOST))


def _texture(key: str, entry: dict[str, Any], *, moved: bool) -> dict[str, Any]:
    """The bound of a texture. key: its map; moved: whether parallax moves its samples."""
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
    left_out = entry["required_detail"]["left_out"] if entry["required_detail"] else 0
    if left_out:
        unbounded.append(
            "triangles that show a line or a point of it (they may need levels that are left out)"
        )
    unit = "degrees" if measure == "max_deg" else "codes"
    if not levels or any(measure not in level for level in levels):
        return bound(None, unit, "a texel", [], ["its texels", *unbounded])
    scale = SIX if measure == "max_deg" else 255.0 * SIX
    worst_level = max(range(len(levels)), key=lambda at: levels[at][measure])
    value = levels[worst_level][measure] * scale
    terms = [{"name": f"level {worst_level}, a texel", "value": value, "unit": unit}]
    if measure == "max_deg":
        undecided = entry["errors"].get("normal_open_max_deg", 0.0) if key == "normal" else None
        if undecided is None or undecided > 0.0:
            more = "" if undecided is None else f" (at most {undecided:.3g} degrees at level 0)"
            unbounded.insert(0, f"what the source's 8 or 16 bits leave undecided{more}")
        return bound(value, unit, "a texel", terms, unbounded)
    if MAPS[key].kind == "color":
        whole = 255.0 * mixed(value / 255.0)
        terms.append({"name": "mixing in linear light", "value": whole - value, "unit": unit})
        value = whole
    if key == "gloss":
        unbounded.insert(0, "smoothness within what the source's 8 or 16 bits leave undecided")
    if left_out:
        plural = "levels are" if left_out > 1 else "level is"
        name = f"{left_out} finer {plural} left out, which no pixel samples:"
        terms.append({"name": name, "value": 0.0, "unit": unit})
    return bound(value, unit, "a pixel", terms, unbounded)


def _sky(entry: dict[str, Any]) -> dict[str, Any]:
    error = entry["errors"].get("sky_max_relative")
    value = None if error is None else 100.0 * error * SIX
    unbounded = ["its coarser levels, which rough mirrors show"]
    if "panorama_max_relative" in entry["errors"]:
        value = None
        unbounded.insert(0, "what cutting it out of the panorama changed, which is measured by samples")
    return bound(value, "%", "a texel's light", [], unbounded)


def bound_short(bound: dict[str, Any] | None) -> str:
    """The value of a bound with its unit, for a table."""
    if bound is None or bound["value"] is None:
        return "-" if bound is None else "no bound"
    if bound["what"] == "a sample":
        return "none"
    return f"{_up(bound['value'])} {'of 255' if bound['unit'] == 'codes' else bound['unit']}"


def bound_words(bound: dict[str, Any]) -> list[str]:
    """A bound in words, a line each: its value and where it is reached, its terms, what is not bounded."""
    if bound["what"] == "a sample":
        return ["its bytes are those of its source"]
    terms = [_term_words(term) for term in bound["terms"]]
    open_ended = [f"not bounded: {', '.join(bound['open'])}"] if bound["open"] else []
    if bound["value"] is None:
        return [f"no bound of what it does to {bound['what']}", *(f"  {term}" for term in terms), *open_ended]
    if bound["unit"] == "px":
        line = f"on the screen its surface lies at most {bound_short(bound)} from where its source's would"
    elif bound["unit"] == "degrees":
        line = f"the direction of {bound['what']} is off by at most {bound_short(bound)}"
    else:
        line = f"{bound['what']} is off by at most {bound_short(bound)}"
    if worst := next((term for term in bound["terms"] if term["value"] == bound["value"]), None):
        line += f": {worst['name']}{_where(worst)}"
    return [line, *(f"  {term}" for term in terms if len(terms) > 1), *open_ended]


def _where(term: dict[str, Any]) -> str:
    if "away_m" not in term:
        return ""
    when = "by the free camera" if term["second_s"] is None else f"at second {term['second_s']:g}"
    return f", seen {when} from {term['away_m']:.3g} m"


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
    """A number rounded up to three digits, at least a thousandth."""
    if 0.0 < value < 0.001:
        return "0.001"
    text = f"{value:.3g}"
    if float(text) < value * (1.0 - 1e-9):
        text = f"{float(text) + 10.0 ** (math.floor(math.log10(value)) - 2):.3g}"
    return text
