"""Chooses the tier that a budget allows by what each tier measured, and reports by how much a budget is
missed.

The order of tiers is declared (tiers.py), never timed.
"""

from __future__ import annotations

from collections.abc import Mapping

from paradize.build.tiers.tuned_settings import by_cost
from paradize.errors import BakeError
from paradize.scene.budget import METRICS, excesses, is_beyond
from paradize.scene.schema import Limits

Products = Mapping[str, Mapping[str, float]]  # errors by product name: metric -> value


def inside(products: Products, limits: Mapping[str, float]) -> bool:
    """Whether all errors of all products are inside these limits."""
    return not any(excesses(Limits(hard=dict(limits)), errors) for errors in products.values())


def cheapest(measured: Mapping[str, Products], budget: Limits) -> str | None:
    """Returns the cheapest tier inside the soft limits, where they are given; else the cheapest inside the
    hard ones; else None. measured: by tier."""
    for limits in (budget.aim, budget.hard):
        for tier in by_cost(measured):
            if inside(measured[tier], limits):
                return tier
    return None


def limited(products: Products, budget: Limits) -> dict[str, dict[str, float]]:
    """Returns for each product the errors that the budget limits."""
    return {
        name: {metric: value for metric, value in errors.items() if metric in budget.aim}
        for name, errors in products.items()
    }


def misses(measured: Mapping[str, Products], budget: Limits, file: object = None) -> list[BakeError]:
    """Returns an error for each hard limit that no tier keeps, with the tier that comes nearest. If each
    limit is kept by some tier but no tier keeps all, returns one error that lists what each tier misses."""
    missed_limits = []
    names = dict.fromkeys(name for products in measured.values() for name in products)
    for name in names:
        for metric, limit in budget.hard.items():
            values = {
                tier: products[name][metric]
                for tier, products in measured.items()
                if metric in products.get(name, {})
            }
            if not values or not all(is_beyond(metric, value, limit) for value in values.values()):
                continue
            best = min if METRICS[metric].less_is_better else max
            tier = best(values, key=lambda tier: values[tier])
            unit = METRICS[metric].unit
            what = (
                f"no tier keeps the budget: {metric} is {values[tier]:g} {unit} at best (tier {tier}), "
                f"{abs(values[tier] - limit):.3g} {unit} beyond {limit:g}"
            )
            levels = metric.startswith(("surface_", "lod_", "uv_shift_"))
            mend = f"accept {metric} = {values[tier]:g}, or give a source that loses less"
            mend += ", or ask for fewer or finer levels of detail where there are several" if levels else ""
            missed_limits.append(BakeError(what, file=file, place=name, mend=mend))
    if not missed_limits:
        missed = [
            f"{tier}: {name} {excess}"
            for tier, products in measured.items()
            for name, errors in products.items()
            for excess in excesses(budget, errors)
            if excess.hard
        ]
        what = f"no tier keeps all of the budget at once ({'; '.join(missed)})"
        missed_limits.append(BakeError(what, file=file, mend="accept more of one of these"))
    return missed_limits
