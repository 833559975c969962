"""Settings between the tiers: where a tier does not keep a budget, `auto` turns one setting of it before it
takes the next, which would cost every player more.

The terrain's bound: tier `exact` passes through every pixel, where `balanced` under a tighter bound mostly
does. Bisection on the bound's logarithm; what is tried depends on what was measured alone, so it is the same
anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from paradize.scene.tiers import TIERS

STEPS = 9  # settings tried at most
CLOSE_ENOUGH = 1.02  # a ratio of one inside and one outside the budget that is near enough


@dataclass(frozen=True)
class TunedSetting:
    """setting: its name, a number above 0 whose smaller values err less. tier: the one in which it is turned,
    and before which other tier that is done."""

    setting: str
    tier: str
    before: str


TUNED_SETTINGS = {"terrain": TunedSetting("max_error_m", "balanced", "exact")}


def tuned_label(tuned: TunedSetting, value: float) -> str:
    """As `taken` and tables name a tier with a setting of its own."""
    return f"{tuned.tier}, {tuned.setting} {value!r}"


def split_label(label: str) -> tuple[str, dict[str, float]]:
    """The tier in a label, and the setting that goes with it, if any."""
    tier, _, rest = label.partition(", ")
    for tuned in TUNED_SETTINGS.values():
        if rest.startswith(f"{tuned.setting} "):
            return tier, {tuned.setting: float(rest.rpartition(" ")[2])}
    return tier, {}


def next_value(given: float, tried: Mapping[float, bool]) -> float | None:
    """The value to try next, below the given one, of three digits; None where no further is worth it. tried:
    by value, whether it was inside the budget; the given one was not."""
    inside = max((value for value, is_inside in tried.items() if is_inside), default=None)
    outside = min((value for value, is_inside in tried.items() if not is_inside), default=given)
    if len(tried) >= STEPS or outside <= 0.0 or (inside and outside < CLOSE_ENOUGH * inside):
        return None
    value = float(f"{math.sqrt(inside * outside) if inside else 0.5 * outside:.3g}")
    return value if 0.0 < value < given and value not in tried else None


def next_label(
    baker: str, labels: Iterable[str], given: float | None, tried: Mapping[str, bool]
) -> str | None:
    """What `auto` tries next, None where it is done: the labels in their order up to one inside the budget,
    and after its tier the maker's dial. given: its setting as asked for; None: it is not to be turned. tried:
    by label, whether it was inside."""
    tuned = TUNED_SETTINGS.get(baker)
    if tuned and given is not None and not tried.get(tuned.tier, True):
        settings = {label: split_label(label)[1] for label in tried}
        values = {one[tuned.setting]: tried[label] for label, one in settings.items() if one}
        value = next_value(given, values)
        if value is not None:
            return tuned_label(tuned, value)
    return None if any(tried.values()) else next((label for label in labels if label not in tried), None)


def by_cost(labels: Iterable[str]) -> list[str]:
    """Labels, the cheapest first: tiers as declared, after each its settings, the loosest first; formats
    last."""

    def cost(label: str) -> tuple[int, int, float]:
        tier, tuned = split_label(label)
        plain = label == tier
        loose = -next(iter(tuned.values()), 0.0)
        larger = 0 if plain or tuned else len(TIERS)
        return larger + TIERS.index(tier), int(not plain), loose

    return sorted(labels, key=cost)
