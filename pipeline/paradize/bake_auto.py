"""Tier by tier: of each order the one that is asked for; for `auto` the cheapest whose measured errors are
inside the scene's budget. What every tier measured stays in the store, so that no tier is tried twice.

Inside means: inside the soft limits where they are given. Where no tier is, the cheapest inside the hard
limits is taken; where none is inside those, that is an error. The order of tiers is declared, never timed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paradize.bake_tasks import How, Task, known, recall, run_tasks, task_of
from paradize.budget import METRICS, excesses, is_beyond
from paradize.engine.memory import FileMemory
from paradize.engine.store import Stamp, Store
from paradize.errors import BakeError, GroupedError, ParadizeError
from paradize.require import Order
from paradize.scene import TIERS, Scene
from paradize.schema import Limits

AUTO = TIERS[-1]
ORDER = TIERS[:-1]  # the cheapest first

# By artifact: the tier asked for, the one taken, and what each tier that was tried measured of the metrics
# that the budget limits: {"asked", "taken", "errors": {tier: {metric: value}}}.
Tried = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Bench:
    """What tasks are made with: see bake_tasks.run_tasks."""

    store: Store
    room: Path
    scene: Scene
    memory: FileMemory
    stamps: Mapping[Path, Stamp | None]
    how: How

    def task(self, order: Order, tier: str) -> Task:
        return task_of(order, self.memory, tier, self.scene)

    def measure(self, tasks: list[Task]) -> None:
        """Finds out the tasks' errors: the store knows them, or the tasks are baked."""
        if not self.how.force:
            self.store.expect(task.key for task in tasks)
        for task in tasks:
            told = None if self.how.force else known(self.store, task)
            task.products, task.status = told or {}, "reused" if told else "baked"
        self.bake(task for task in tasks if task.status == "baked")

    def take(self, tasks: list[Task]) -> None:
        """Sees to it that the tasks have what they made: from the store, or baked."""
        for task in tasks:
            if task.status == "reused" and not recall(self.store, task):
                task.status = "baked"
        self.bake(task for task in tasks if task.status == "baked" and not task.data and not task.error)

    def bake(self, tasks: Iterable[Task]) -> None:
        run_tasks(self.store, self.room, list(tasks), self.stamps, self.how)


@dataclass
class _Choice:
    """An order, the tier that is asked of it, and its tasks so far by tier, in the order they were tried.
    errors: by tier, of each of its products by name, what the budget limits."""

    order: Order
    asked: str
    tasks: dict[str, Task] = field(default_factory=dict)
    errors: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)

    def inside(self, tier: str, limits: Mapping[str, float]) -> bool:
        """Whether all that a tier made is inside these limits."""
        budget = Limits(hard=dict(limits))
        return tier in self.errors and not any(excesses(budget, one) for one in self.errors[tier].values())

    def following(self, budget: Limits) -> str | None:
        """The tier to try next; None where one is inside the budget, or none is left or would help."""
        if any(task.error for task in self.tasks.values() if self.asked != AUTO):
            return None
        if any(self.inside(tier, budget.aim) for tier in self.tasks):
            return None
        left = [tier for tier in ORDER if tier not in self.tasks]
        return left[0] if left else None

    def taken(self, budget: Limits) -> str | None:
        """The tier to take; None where no tier is inside the hard limits."""
        if self.asked != AUTO:
            return self.asked
        tried = [tier for tier in ORDER if tier in self.tasks]
        for limits in (budget.aim, budget.hard):
            for tier in tried:
                if self.inside(tier, limits):
                    return tier
        return None

    def miss(self, budget: Limits) -> list[ParadizeError]:
        """By how much each limit is missed, by the tier that comes nearest to it."""
        wrong = [task.error for task in self.tasks.values() if task.error]
        if not self.errors:
            return wrong[:1]
        found: list[ParadizeError] = []
        for want in self.order.wants:
            measured = {
                tier: errors[want.product] for tier, errors in self.errors.items() if want.product in errors
            }
            for metric, limit in budget.hard.items():
                values = {tier: errors[metric] for tier, errors in measured.items() if metric in errors}
                if not values or not all(is_beyond(metric, value, limit) for value in values.values()):
                    continue
                pick = min if METRICS[metric].less_is_better else max
                tier = pick(values, key=lambda name: values[name])
                unit = METRICS[metric].unit
                what = (
                    f"no tier keeps the budget: {metric} is {values[tier]:g} {unit} at best (tier {tier}), "
                )
                what += f"{abs(values[tier] - limit):.3g} {unit} beyond {limit:g}"
                mend = f"allow it: {metric} = {values[tier]:g} in [budget]; or give a source that loses less"
                file = next(iter(self.order.sources.values()), None)
                found.append(BakeError(what, file=file, place=want.artifact or want.product, mend=mend))
        if not found:
            what = "no tier keeps all of the budget at once: " + "; ".join(
                f"{tier}: {excess}"
                for tier, products in self.errors.items()
                for errors in products.values()
                for excess in excesses(budget, errors)
                if excess.hard
            )
            found.append(
                BakeError(what, place=self.order.name, mend="allow more of one of these in [budget]")
            )
        return [*found, *wrong]


def bake_orders(bench: Bench, orders: list[Order]) -> tuple[list[Task], Tried]:
    """A task of each order, in the tier that is asked for or that `auto` finds; and what was tried, of those
    that `auto` decided and those beyond their budget, whose other tiers are measured too. Errors are in the
    tasks."""
    budget = bench.scene.budget
    choices = [_Choice(order, bench.how.tier_of(order, bench.scene)) for order in orders]
    for choice in choices:
        first = ORDER[0] if choice.asked == AUTO else choice.asked
        choice.tasks[first] = bench.task(choice.order, first)
    fresh = [(choice, tier) for choice in choices for tier in choice.tasks]
    while fresh:
        bench.measure([choice.tasks[tier] for choice, tier in fresh])
        for choice, tier in fresh:
            if not choice.tasks[tier].error:
                choice.errors[tier] = _limited(choice.tasks[tier], budget)
        follow = [(choice, choice.following(budget)) for choice in choices]
        fresh = [(choice, tier) for choice, tier in follow if tier]
        for choice, tier in fresh:
            choice.tasks[tier] = bench.task(choice.order, tier)
    tasks = [_chosen(choice, budget) for choice in choices]
    bench.take(tasks)
    return tasks, _told(choices, tasks)


def _limited(task: Task, budget: Limits) -> dict[str, dict[str, float]]:
    """Of each product of a task the errors that the budget limits."""
    return {
        name: {metric: value for metric, value in product["errors"].items() if metric in budget.aim}
        for name, product in task.products.items()
    }


def _chosen(choice: _Choice, budget: Limits) -> Task:
    """The task to take; one with an error where no tier will do."""
    tier = choice.taken(budget)
    if tier is not None:
        return choice.tasks[tier]
    task = choice.tasks[next(reversed(choice.tasks))]
    errors = choice.miss(budget)
    task.error = errors[0] if len(errors) == 1 else GroupedError(errors)
    task.status, task.products, task.data = "failed", {}, {}
    return task


def _told(choices: list[_Choice], tasks: list[Task]) -> Tried:
    found: Tried = {}
    for choice, task in zip(choices, tasks, strict=True):
        if choice.asked != AUTO and len(choice.tasks) == 1:
            continue
        for want in task.wants:
            if want.kind:
                errors = {tier: errors.get(want.product, {}) for tier, errors in choice.errors.items()}
                found[want.artifact] = {"asked": choice.asked, "taken": task.tier, "errors": errors}
    return found
