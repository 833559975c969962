"""`paradize explain`: of each artifact, which pass of the scene asked for it and why, when the flight first
needs it, who asked for its finest level and what was saved by not baking more, which input has changed since,
and for an object's maps how wide their gutters are, how wide they should be, and which number decides.

Reads the scene, and scene.json of the last bake where there is one.
"""

from __future__ import annotations

import difflib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paradize.bake_choice import AUTO
from paradize.bake_inputs import stale
from paradize.bake_looks import looks_of
from paradize.bake_record import SCENE_FILE
from paradize.budget import excesses
from paradize.errors import FormatError, SceneError
from paradize.explain_asked import economy, economy_words, short
from paradize.formats.scene_manifest import decode_scene
from paradize.require import Order, Want, require
from paradize.scene import Scene, load_scene
from paradize.schema import Limits


@dataclass(frozen=True)
class Explanation:
    """scene: its name. folder: where the last bake is looked for; baked: whether there is one, and why not.
    artifacts: told as --json prints them."""

    scene: str
    folder: Path
    baked: bool
    why_not: str
    artifacts: list[dict[str, Any]]

    def as_json(self) -> dict[str, Any]:
        """The object that --json prints."""
        return {
            "scene": self.scene,
            "folder": str(self.folder),
            "baked": self.baked,
            "why_not": self.why_not or None,
            "artifacts": self.artifacts,
        }


def explain(scene_path: Path, artifact: str | None = None, out: Path | None = None) -> Explanation:
    """Explains every artifact of a scene, or one. out: the folder of its bake (default: build/assets/<name>).

    Raises SceneError for a scene that cannot be read and for an artifact that it does not ask for.
    """
    scene = load_scene(scene_path)
    folder = out or Path("build/assets") / scene.head.name
    manifest, why_not = _last_bake(folder)
    terrain = manifest["terrain"] if manifest else None
    tiles = {f"mesh_{k}" for k in range(1, len(terrain["tiles"]))} if terrain else set()
    wanted = {
        made.artifact: (order, made)
        for order in require(scene, looks_of(scene, scene_path)[0]).orders
        for want in order.wants
        if want.kind
        for made in want.made(tiles)
    }
    if artifact is not None and artifact not in wanted:
        near = difflib.get_close_matches(artifact, wanted, n=1)
        mend = f"did you mean {near[0]}? There are " if near else "there are "
        raise SceneError(
            f"asks for no artifact {artifact!r}", file=scene_path, mend=mend + ", ".join(sorted(wanted))
        )
    names = [artifact] if artifact is not None else list(wanted)
    told = [_told(scene, *wanted[name], manifest, folder) for name in names]
    return Explanation(scene.head.name, folder, manifest is not None, why_not, told)


def _last_bake(folder: Path) -> tuple[dict[str, Any] | None, str]:
    """The manifest of the last bake, or None and why."""
    path = folder / SCENE_FILE
    try:
        return decode_scene(path.read_bytes(), path), ""
    except OSError:
        return None, f"there is no bake in {folder}: seconds, errors and gutters are not known before"
    except FormatError as error:
        return None, f"{error}; bake it again"


def _told(
    scene: Scene, order: Order, want: Want, manifest: dict[str, Any] | None, folder: Path
) -> dict[str, Any]:
    entry = manifest["artifacts"].get(want.artifact) if manifest else None
    told: dict[str, Any] = {
        "name": want.artifact,
        "kind": want.kind,
        "passes": list(want.passes),
        "reason": want.reason,
        "sources": {role: str(path) for role, path in order.sources.items()},
        "settings": order.settings,
        "first_needed_s": None,
        "gutter": None,
        "demand": None,
        "tried": None,
        "asked": None,
        "stale": None,
    }
    if entry is None:
        return told
    told |= {key: entry[key] for key in ("first_needed_s", "file", "bytes", "tier", "errors", "levels")}
    told["tried"] = _tried(manifest or {}, want.artifact)
    told["asked"] = economy(manifest or {}, folder, want.artifact)
    told["stale"] = stale(folder, scene, order)
    terrain = (manifest or {})["terrain"]
    if terrain and want.artifact in terrain["tiles"]:
        told["demand"] = _demand(terrain, want.artifact)
    owner = next((o for o in (manifest or {})["objects"] if want.artifact in o.values()), None)
    if entry["gutter"] is not None and owner is not None:
        told["gutter"] = entry["gutter"] | {
            "max_level": entry["max_level"],
            "levels": len(entry["gutter"]["bleed_p99"]),
            "parallax": _parallax(owner),
        }
        told["decides"] = _decides(told["gutter"])
    return told


def _tried(manifest: dict[str, Any], artifact: str) -> dict[str, Any] | None:
    """Which tier was asked for and which taken, what each that was tried measured, and the limits of that."""
    tried = manifest["check"]["tried"].get(artifact)
    if tried is None:
        return None
    metrics = {metric for errors in tried["errors"].values() for metric in errors}
    limits = {
        part: {metric: limit for metric, limit in manifest["budget"][part].items() if metric in metrics}
        for part in ("hard", "soft")
    }
    return {**tried, "limits": limits}


def _choice(tried: dict[str, Any]) -> list[str]:
    """In words: the tier that was taken, and what each tier measured beside its limit."""
    budget = Limits(tried["limits"]["hard"], tried["limits"]["soft"])
    if tried["asked"] != AUTO:
        words = [f"tier {tried['taken']} was asked for, and is beyond its budget; the tiers measured:"]
    elif not budget.aim:
        return [f"auto took tier {tried['taken']}: no budget limits it"]
    else:
        soft = any(excesses(budget, tried["errors"].get(tried["taken"], {})))
        why = (
            "the cheapest inside the hard limits; none is inside the soft ones"
            if soft
            else "the cheapest inside the budget"
        )
        words = [f"auto took tier {tried['taken']}, {why}"]
    for tier, errors in tried["errors"].items():
        beyond = {excess.metric: excess for excess in excesses(budget, errors)}
        parts = []
        for metric, value in errors.items():
            limit = beyond[metric].limit if metric in beyond else budget.aim[metric]
            parts.append(f"{metric} {value:g} ({'beyond' if metric in beyond else 'inside'} {limit:g})")
        words.append(f"  {tier}: {', '.join(parts) or 'nothing that is limited'}")
    return words


def _demand(terrain: dict[str, Any], artifact: str) -> dict[str, Any]:
    """What the flight asks of the terrain, and how many patches of each level a tile and the terrain have."""
    patches, tile = terrain["patches"], terrain["tiles"].index(artifact)
    levels = list(zip(patches["tile"], patches["level"], strict=True))
    here = Counter(level for number, level in levels if number == tile)
    asked: dict[str, Any] = terrain["demand"]
    return asked | {
        "tiles": len(terrain["tiles"]),
        "patches": len(levels),
        "here": {str(level): count for level, count in sorted(here.items())},
    }


def _asked(demand: dict[str, Any]) -> list[str]:
    """In words: which second asked for the finest patches, and what was left out."""
    levels = list(demand["here"])
    span = f"level {levels[0]}" if len(levels) == 1 else f"levels {levels[0]} to {levels[-1]}"
    words = [
        f"{sum(demand['here'].values())} of {demand['patches']} patches, {span} (0 is the coarsest); the "
        f"terrain has {demand['tiles']} file{'s' if demand['tiles'] > 1 else ''}"
    ]
    if demand["finest_s"] is not None:
        words.append(
            f"the finest, level {demand['finest_level']}, are first asked for at second "
            f"{demand['finest_s']:g}"
        )
    if demand["left_out"]:
        words.append(
            f"{demand['left_out']} patches that no second asks for are left out: some "
            f"{short(demand['left_out_bytes'])} saved"
        )
    return words


def _parallax(owner: dict[str, Any]) -> dict[str, Any]:
    """By material: what is asked of parallax, and what is given (scale and bias)."""
    found = {}
    for name, material in owner["materials"].items():
        scale, bias, limit = (material[f"parallax_{key}"] for key in ("scale", "bias", "limit"))
        reach = 0.5 * abs(scale) + abs(bias)
        share = 1.0 if limit is None or reach <= limit else limit / reach
        found[name] = {
            "asked": [scale, bias],
            "given": [scale * share, bias * share],
            "reach": reach,
            "limit": limit,
        }
    return found


def _decides(gutter: dict[str, Any]) -> list[str]:
    """In words: which number decides how far the map may be sampled."""
    p99, worst, bound = gutter["bleed_p99"], gutter["bleed_max"], gutter["bound"]
    last, safe, in_use = len(p99) - 1, gutter["max_level"], gutter["level_in_use"]
    words = []
    if gutter["width_texels"] is None:
        words.append("one island: nothing foreign can bleed in")
    elif gutter["level_by_width"] >= in_use:
        words.append(f"the width alone is enough for level {in_use}, the coarsest that the flight uses")
    else:
        by_width = gutter["level_by_width"]
        reached = f"for level {by_width} at most" if by_width >= 0 else "for no level"
        words.append(f"the width alone is enough {reached}; the colours of neighbours decide")
    if safe is None:
        words.append(
            f"at every level at most {max(p99):.3g} bleeds in (99 of 100 samples; {bound:g} is accepted), "
            "so that none is left out"
        )
        return words
    after = safe + 1
    if p99[after] > bound:
        words.append(
            f"level {after} would bleed by {p99[after]:.3g} (99 of 100 samples; {bound:g} is accepted), so "
            f"level {safe} of {last} is the last that is sampled"
        )
    else:
        words.append(
            f"at level {after} a sample would be off by {worst[after]:.3g} (none may be by more than "
            f"{2.5 * bound:g}), so level {safe} of {last} is the last that is sampled"
        )
    if safe < in_use:
        words.append(
            f"the flight would use level {in_use}: the object may shimmer from afar; move its islands apart, "
            "paint neighbours alike, or accept more with the object's bleed; islands are not repacked, for "
            "their maps are painted pictures"
        )
    return words


def render(explanation: Explanation, *, details: bool) -> str:
    """As text: a paragraph for each artifact; details: with sources, settings and every level."""
    lines = []
    for told in explanation.artifacts:
        lines += words_of(told, details)
    if explanation.why_not:
        lines.append(explanation.why_not)
    return "\n".join(lines)


def _plain(value: Any) -> str:
    """A setting as a person writes it."""
    if isinstance(value, dict):
        return ", ".join(f"{key} {_plain(inner)}" for key, inner in value.items()) or "none"
    if isinstance(value, list | tuple):
        return ", ".join(_plain(inner) for inner in value) or "none"
    if value is None or isinstance(value, bool):
        return "yes" if value else "none" if value is None else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def words_of(told: dict[str, Any], details: bool = False) -> list[str]:
    """What is told of an artifact, a line each; the first names it."""
    asked = f"asked for by {_passes(told['passes'])}" if told["passes"] else "heard, not drawn"
    lines = [f"{told['name']}: {told['reason']}", f"  {asked}"]
    if told["first_needed_s"] is not None:
        lines[-1] += f"; first needed at second {told['first_needed_s']:g} of the flight"
    if details:
        lines += [f"  {role}: {path}" for role, path in told["sources"].items()]
        lines += [f"  {key} = {_plain(value)}" for key, value in told["settings"].items()]
        if "errors" in told:
            lines.append(f"  {told['file']}, {told['bytes']} bytes, tier {told['tier']}")
            lines += [f"  {metric} {value:g}" for metric, value in told["errors"].items()]
    if told["tried"] is not None:
        lines += [f"  {words}" for words in _choice(told["tried"])]
    if told["demand"] is not None:
        lines += [f"  {words}" for words in _asked(told["demand"])]
    if told["asked"] is not None:
        lines += [f"  {words}" for words in economy_words(told["asked"], told["kind"])]
    if told["stale"] is not None:
        lines += [f"  stale: {words}" for words in told["stale"]] or ["  up to date"]
    gutter = told["gutter"]
    if gutter is None:
        return lines
    width = gutter["width_texels"]
    has = "alone on the map" if width is None else f"{width:g} texels at the narrowest"
    lines.append(
        f"  gutter: {gutter['islands']} islands, {has}; {gutter['needed_texels']:g} needed for level "
        f"{gutter['level_in_use']} and the steepest parallax"
    )
    lines += [f"  {words}" for words in told["decides"]]
    for name, parallax in gutter["parallax"].items():
        if parallax["reach"] > 0.0:
            scale, bias = parallax["asked"]
            given = parallax["given"]
            how = "given" if given == parallax["asked"] else f"given {given[0]:.4g} (bias {given[1]:.4g})"
            lines.append(f"  parallax of {name}: scale {scale:g} (bias {bias:g}) asked, {how}")
    if details:
        lines.append("  level  99 of 100  largest")
        for level, (p99, worst) in enumerate(zip(gutter["bleed_p99"], gutter["bleed_max"], strict=True)):
            lines.append(f"  {level:5d}  {p99:9.4f}  {worst:7.4f}")
    return lines


def _passes(names: list[str]) -> str:
    if len(names) == 1:
        return f"the {names[0]} pass"
    return f"the passes {', '.join(names[:-1])} and {names[-1]}"
