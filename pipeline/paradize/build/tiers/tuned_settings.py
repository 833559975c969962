"""Settings between two tiers. Where a tier exceeds the budget, `auto` tunes one setting of it before it takes
the next tier, which costs every player more.

For terrain that is the error bound: tier `exact` passes through every pixel, while `balanced` with a tighter
bound often suffices. Bisection on the bound's logarithm. The values tried depend only on measured errors, so
they are the same on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from paradize.tiers import TIERS

STEPS = 9  # values tried at most
CLOSE_ENOUGH = 1.02  # ratio of a value outside to one inside the budget at which the search ends


@dataclass(frozen=True)
class TunedSetting:
    """setting: its name; a number above 0, smaller values err less. tier: the tier in which it is tuned.
    before: the tier that is tried afterwards."""

    setting: str
    tier: str
    before: str


TUNED_SETTINGS = {"terrain": TunedSetting("max_error_m", "balanced", "exact")}


def tuned_label(tuned: TunedSetting, value: float) -> str:
    """Returns the name of a tier with a tuned setting, as `taken` and tables write it."""
    return f"{tuned.tier}, {tuned.setting} {value!r}"


def split_label(label: str) -> tuple[str, dict[str, float]]:
    """Returns the tier in a label, and the tuned setting, if any."""
    tier, _, rest = label.partition(", ")
    for tuned in TUNED_SETTINGS.values():
        if rest.startswith(f"{tuned.setting} "):
            return tier, {tuned.setting: float(rest.rpartition(" ")[2])}
    return tier, {}


def next_value(given: float, tried: Mapping[float, bool]) -> float | None:
    """Returns the value to try next, below the given one, with three digits; None if no further one is
    worth trying. tried: by value, whether it was inside the budget; the given value was not."""
    inside = max((value for value, is_inside in tried.items() if is_inside), default=None)
    outside = min((value for value, is_inside in tried.items() if not is_inside), default=given)
    if len(tried) >= STEPS or outside <= 0.0 or (inside and outside < CLOSE_ENOUGH * inside):
        return None
    value = float(f"{math.sqrt(inside * outside) if inside else 0.5 * outside:.3g}")
    return value if 0.0 < value < given and value not in tried else None


def next_label(
    baker: str, labels: Iterable[str], given: float | None, tried: Mapping[str, bool]
) -> str | None:
    """Returns the label to try next, or None: the labels in order up to one inside the budget, and after
    its tier the tuned setting of this baker. given: the setting's value in the scene; None: it is not
    tuned. tried: by label, whether it was inside the budget."""
    tuned = TUNED_SETTINGS.get(baker)
    if tuned and given is not None and not tried.get(tuned.tier, True):
        settings = {label: split_label(label)[1] for label in tried}
        values = {
            values_of_trial[tuned.setting]: tried[label]
            for label, values_of_trial in settings.items()
            if values_of_trial
        }
        value = next_value(given, values)
        if value is not None:
            return tuned_label(tuned, value)
    return None if any(tried.values()) else next((label for label in labels if label not in tried), None)


def by_cost(labels: Iterable[str]) -> list[str]:
    """Sorts labels, cheapest first: tiers as declared, each followed by its tuned settings from loose to
    tight; finer formats last."""

    def cost(label: str) -> tuple[int, int, float]:
        tier, tuned = split_label(label)
        plain = label == tier
        loose = -next(iter(tuned.values()), 0.0)
        larger = 0 if plain or tuned else len(TIERS)
        return larger + TIERS.index(tier), int(not plain), loose

    return sorted(labels, key=cost)
