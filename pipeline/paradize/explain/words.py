"""What `paradize explain` tells, in words (explain/facts.py finds the facts)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from paradize.build.tier_choice import AUTO
from paradize.explain.bounds import bound_words
from paradize.explain.economy import economy_words, saved_words, short
from paradize.scene.budget import excesses
from paradize.scene.schema import Limits

if TYPE_CHECKING:
    from paradize.explain.facts import Explanation


def render(explanation: Explanation, *, details: bool) -> str:
    """As text: a paragraph for each artifact; details: with sources, settings and every level."""
    lines = []
    for told in explanation.artifacts:
        lines += words_of(told, details)
    if explanation.saved:
        lines.append(saved_words(explanation.saved))
    if explanation.why_not:
        lines.append(explanation.why_not)
    return "\n".join(lines)


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
    if told["bound"] is not None:
        lines.append(f"  {bound_words(told['bound'])}")
    if told["stale"] is not None:
        lines += [f"  stale: {words}" for words in told["stale"]] or ["  up to date"]
    gutter = told["gutter"]
    if gutter is None:
        return lines
    width = gutter["width_texels"]
    has = "alone on the map" if width is None else f"{width:g} texels at the narrowest"
    moved = any(parallax["reach"] > 0.0 for parallax in gutter["parallax"].values())
    lines.append(
        f"  gutter: {gutter['islands']} islands, {has}; {gutter['needed_texels']:g} needed for level "
        f"{gutter['level_in_use']}{' and the steepest parallax' if moved else ''}"
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


def _plain(value: Any) -> str:
    """A setting as a person writes it."""
    if isinstance(value, dict):
        return ", ".join(f"{key} {_plain(inner)}" for key, inner in value.items()) or "none"
    if isinstance(value, list | tuple):
        return ", ".join(_plain(inner) for inner in value) or "none"
    if value is None or isinstance(value, bool):
        return "yes" if value else "none" if value is None else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _passes(names: list[str]) -> str:
    if len(names) == 1:
        return f"the {names[0]} pass"
    return f"the passes {', '.join(names[:-1])} and {names[-1]}"
