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

from paradize.scene.settings import TIERS

STEPS = 9  # settings tried at most
NEAR = 1.02  # a ratio of one inside and one outside the budget that is near enough


@dataclass(frozen=True)
class Dial:
    """setting: its name, a number above 0 whose smaller values err less. tier: the one in which it is turned,
    and before which other tier that is done."""

    setting: str
    tier: str
    before: str


DIALS = {"terrain": Dial("max_error_m", "balanced", "exact")}


def label_of(dial: Dial, value: float) -> str:
    """As `taken` and tables name a tier with a setting of its own."""
    return f"{dial.tier}, {dial.setting} {value!r}"


def setting_of(label: str) -> tuple[str, dict[str, float]]:
    """The tier in a label, and the setting that goes with it, if any."""
    tier, _, rest = label.partition(", ")
    for dial in DIALS.values():
        if rest.startswith(f"{dial.setting} "):
            return tier, {dial.setting: float(rest.rpartition(" ")[2])}
    return tier, {}


def next_value(given: float, tried: Mapping[float, bool]) -> float | None:
    """The value to try next, below the given one, of three digits; None where no further is worth it. tried:
    by value, whether it was inside the budget; the given one was not."""
    inside = max((value for value, good in tried.items() if good), default=None)
    outside = min((value for value, good in tried.items() if not good), default=given)
    if len(tried) >= STEPS or outside <= 0.0 or (inside and outside < NEAR * inside):
        return None
    value = float(f"{math.sqrt(inside * outside) if inside else 0.5 * outside:.3g}")
    return value if 0.0 < value < given and value not in tried else None


def next_label(
    maker: str, labels: Iterable[str], given: float | None, tried: Mapping[str, bool]
) -> str | None:
    """What `auto` tries next, None where it is done: the labels in their order up to one inside the budget,
    and after its tier the maker's dial. given: its setting as asked for; None: it is not to be turned. tried:
    by label, whether it was inside."""
    dial = DIALS.get(maker)
    if dial and given is not None and not tried.get(dial.tier, True):
        turned = {label: setting_of(label)[1] for label in tried}
        values = {one[dial.setting]: tried[label] for label, one in turned.items() if one}
        value = next_value(given, values)
        if value is not None:
            return label_of(dial, value)
    return None if any(tried.values()) else next((label for label in labels if label not in tried), None)


def by_cost(labels: Iterable[str]) -> list[str]:
    """Labels, the cheapest first: tiers as declared, after each its settings, the loosest first; formats
    last."""

    def cost(label: str) -> tuple[int, int, float]:
        tier, turned = setting_of(label)
        plain = label == tier
        loose = -next(iter(turned.values()), 0.0)
        larger = 0 if plain or turned else len(TIERS)
        return larger + TIERS.index(tier), int(not plain), loose

    return sorted(labels, key=cost)
