"""Prints the facts of `paradize explain` (facts.py) as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from paradize.explain.bounds import bound_short, bound_words
from paradize.explain.economy import economy_words, saved_words
from paradize.files import bytes_text
from paradize.scene.budget import excesses, meaning_of, unit_of
from paradize.scene.schema import Limits
from paradize.tiers import AUTO

if TYPE_CHECKING:
    from paradize.explain.facts import Explanation


_MOST_SETTING = 120  # characters of a setting; a flight has thousands
OVERVIEW = ("artifact", "why", "first needed", "error at most", "bytes")


def overview(explanation: Explanation) -> list[Sequence[str]]:
    """A row of OVERVIEW for each artifact; "-" where it is not known before a bake."""
    rows: list[Sequence[str]] = []
    for facts in explanation.artifacts:
        needed = facts["first_needed_s"]
        when = "-" if needed is None else f"second {needed:g}"
        bound = bound_short(facts["bound"])
        if facts["constant"] is not None:
            when, bound = "no file", f"all texels {_values(facts)}"
        if facts["same_as"] is not None:
            when, bound = "no file", f"is {facts['same_as']}"
        rows.append((facts["name"], facts["reason"], when, bound, _bytes(facts)))
    return rows


def unread(explanation: Explanation) -> list[str]:
    """A line for each picture of a material that is not baked, because no pass reads it."""
    return [f"not baked: {picture['file']}: {picture['reason']}" for picture in explanation.unread]


def _values(facts: dict[str, Any]) -> str:
    return ", ".join(f"{value:g}" for value in facts["constant"])


def _bytes(facts: dict[str, Any]) -> str:
    return str(facts["bytes"]) if "bytes" in facts else "-"


def sums(explanation: Explanation) -> list[str]:
    """The totals of all artifacts, a line each."""
    lines = []
    if explanation.saved is not None:
        baked = [facts["bytes"] for facts in explanation.artifacts if "bytes" in facts]
        lines.append(f"{len(baked)} artifacts, {bytes_text(sum(baked))}; {saved_words(explanation.saved)}")
    if stale := [facts["name"] for facts in explanation.artifacts if facts["stale"]]:
        lines.append(
            f"stale: sources, settings or Paradize itself changed since the bake: {', '.join(stale)}"
        )
    if explanation.why_not:
        lines.append(explanation.why_not)
    return lines


def render(explanation: Explanation) -> str:
    """A paragraph for each artifact with all that is known of it, and the sums."""
    lines = [line for facts in explanation.artifacts for line in words_of(facts, details=True)]
    return "\n".join(lines + sums(explanation))


def words_of(facts: dict[str, Any], details: bool = False) -> list[str]:
    """The lines about an artifact; the first names it."""
    readers = f"read by {_passes(facts['passes'])}" if facts["passes"] else "heard, not drawn"
    lines = [f"{facts['name']}: {facts['reason']}", f"  {readers}"]
    if facts["first_needed_s"] is not None:
        lines[-1] += f"; first needed at second {facts['first_needed_s']:g} of the flight"
    if facts["constant"] is not None:
        lines.append(
            f"  no file: all its texels are equal ({_values(facts)}); the material has it as a factor"
        )
    if facts["same_as"] is not None:
        lines.append(f"  no file of its own: its bytes are those of {facts['same_as']}, which stands for it")
    if details:
        lines += [f"  {role}: {path}" for role, path in facts["sources"].items()]
        given = {key: value for key, value in facts["settings"].items() if value is not None}
        lines += [f"  {key} = {_clipped(_plain(value))}" for key, value in given.items()]
        if "errors" in facts:
            lines.append(f"  {facts['file']}, {facts['bytes']} bytes, tier {facts['tier']}")
            lines += [f"  {_error(metric, value)}" for metric, value in facts["errors"].items()]
    if facts["tried"] is not None:
        lines += [f"  {words}" for words in _choice(facts["tried"])]
    if facts["demand"] is not None:
        lines += [f"  {words}" for words in _demand(facts["demand"])]
    if facts["required_detail"] is not None:
        lines += [f"  {words}" for words in economy_words(facts["required_detail"], facts["kind"])]
    if facts["bound"] is not None:
        lines += [f"  {words}" for words in bound_words(facts["bound"])]
    if facts["stale"] is not None:
        lines += [f"  stale: {words}" for words in facts["stale"]] or ["  up to date"]
    gutter = facts["gutter"]
    if gutter is None:
        return lines
    width = gutter["width_texels"]
    count = "1 island" if gutter["islands"] == 1 else f"{gutter['islands']} islands"
    has = "alone on the map" if width is None else f"{width:g} texels at the narrowest"
    moved = any(parallax["reach"] > 0.0 for parallax in gutter["parallax"].values())
    lines.append(
        f"  gutter: {count}, {has}; {gutter['needed_texels']:g} needed for level "
        f"{gutter['level_in_use']}{' and the steepest parallax' if moved else ''}"
    )
    lines += [f"  {words}" for words in facts["decides"]]
    for name, parallax in gutter["parallax"].items():
        if parallax["reach"] > 0.0:
            scale, bias = parallax["requested"]
            given = parallax["given"]
            limited = f"limited by the gutters to {given[0]:.4g} (bias {given[1]:.4g})"
            how = "not limited" if given == parallax["requested"] else limited
            lines.append(f"  parallax of {name}: scale {scale:g} (bias {bias:g}), {how}")
    if details:
        lines.append("  level  99 of 100  largest")
        for level, (p99, worst) in enumerate(zip(gutter["bleed_p99"], gutter["bleed_max"], strict=True)):
            lines.append(f"  {level:5d}  {p99:9.4f}  {worst:7.4f}")
    return lines


def _error(metric: str, value: float) -> str:
    """A metric with its unit and what it measures."""
    meaning = meaning_of(metric)
    return f"{metric} {value:g} {unit_of(metric)}".rstrip() + (f": {meaning}" if meaning else "")


def _choice(tried: dict[str, Any]) -> list[str]:
    """In words: the tier that was taken, and the errors of each tier beside their limits."""
    budget = Limits(tried["limits"]["hard"], tried["limits"]["soft"])
    if tried["requested"] != AUTO:
        words = [f"tier {tried['taken']} was requested and is beyond its budget; the tiers measured:"]
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


def _demand(demand: dict[str, Any]) -> list[str]:
    """In words: when the finest patches are needed, and what was left out."""
    levels = list(demand["here"])
    span = f"level {levels[0]}" if len(levels) == 1 else f"levels {levels[0]} to {levels[-1]}"
    words = [
        f"{sum(demand['here'].values())} of {demand['patches']} patches, {span} (0 is the coarsest); the "
        f"terrain has {demand['tiles']} file{'s' if demand['tiles'] > 1 else ''}"
    ]
    if demand["finest_s"] is not None:
        words.append(
            f"the finest, level {demand['finest_level']}, are first needed at second {demand['finest_s']:g}"
        )
    if demand["left_out"]:
        words.append(
            f"{demand['left_out']} patches that no second needs are left out: about "
            f"{bytes_text(demand['left_out_bytes'])} saved"
        )
    return words


def _clipped(text: str) -> str:
    return text if len(text) <= _MOST_SETTING else f"{text[:_MOST_SETTING]} ... (all of it with --json)"


def _plain(value: Any) -> str:
    """A setting as text."""
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
