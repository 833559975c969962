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

from paradize.build.dial import next_label, setting_of
from paradize.build.options import BuildContext
from paradize.build.tasks import Task, known, recall, run_tasks, task_of
from paradize.build.tier_choice import AUTO, GROWN, LABELS, ORDER, cheapest, inside, limited, misses
from paradize.errors import GroupedError, ParadizeError
from paradize.scene.requirements import BakeJob
from paradize.scene.schema import Limits
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Stamp

FORMATTED = ("color", "maps")  # the makers whose formats a budget decides

# By artifact: the tier asked for, the one taken, and what each tier that was tried measured of the metrics
# that the budget limits: {"asked", "taken", "errors": {tier: {metric: value}}}.
Tried = dict[str, dict[str, Any]]

# By artifact, then tier: errors that are known only once the artifacts are looked at together.
Later = dict[str, dict[str, dict[str, float]]]


@dataclass(frozen=True)
class Bench:
    """What tasks are made with: see tasks.run_tasks. made: the seconds of those that it has baked, by
    key; what is baked once is not baked again."""

    context: BuildContext
    memory: FileHashCache
    stamps: Mapping[Path, Stamp | None]
    made: dict[str, float] = field(default_factory=dict)

    def task(self, choice: _Choice, label: str) -> Task:
        tier = setting_of(label)[0] if label in GROWN else label
        grow = choice.asked != AUTO or label in GROWN
        raw = self.context.how.uncompressed
        return task_of(choice.order, self.memory, tier, self.context.scene, grow=grow, uncompressed=raw)

    def measure(self, tasks: list[Task]) -> None:
        """Finds out the tasks' errors: the store knows them, or the tasks are baked."""
        if not self.context.how.force:
            self.context.store.expect(task.key for task in tasks)
        for task in tasks:
            told = (
                known(self.context.store, task)
                if not self.context.how.force or task.key in self.made
                else None
            )
            task.products, task.status = told or {}, "reused" if told else "baked"
        self.bake(task for task in tasks if task.status == "baked")

    def take(self, tasks: list[Task]) -> None:
        """Sees to it that the tasks have what they made: from the store, or baked."""
        for task in tasks:
            if task.status == "reused" and not recall(self.context.store, task):
                task.status = "baked"
        self.bake(task for task in tasks if task.status == "baked" and not task.data and not task.error)
        for task in tasks:
            if task.key in self.made and not task.error:  # also where an earlier choice did
                task.status, task.seconds = "baked", self.made[task.key]

    def bake(self, tasks: Iterable[Task]) -> None:
        asked = list(tasks)
        run_tasks(self.context.store, self.context.scratch, asked, self.stamps, self.context.how)
        self.made.update({task.key: task.seconds for task in asked if not task.error})


@dataclass
class _Choice:
    """An order, the tier that is asked of it, and its tasks so far by label, in the order they were
    tried. measured: by tier, of each of its products by name, the errors that the budget limits."""

    order: BakeJob
    asked: str
    tasks: dict[str, Task] = field(default_factory=dict)
    measured: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)

    def following(self, budget: Limits) -> str | None:
        """The tier to try next; None where one is inside the budget, or none is left or would help."""
        if self.asked != AUTO and any(task.error for task in self.tasks.values()):
            return None
        tried = {
            label: label in self.measured and inside(self.measured[label], budget.aim) for label in self.tasks
        }
        grows = self.asked == AUTO and self.order.maker in FORMATTED
        turns = self.asked == AUTO and 0.0 not in budget.aim.values()
        given = self.order.settings.get("max_error_m") if turns else None
        return next_label(self.order.maker, LABELS if grows else ORDER, given, tried)

    def chosen(self, budget: Limits) -> Task:
        """The task to take; one with an error where no tier will do."""
        tier = cheapest(self.measured, budget) if self.asked == AUTO else self.asked
        if tier is not None:
            return self.tasks[tier]
        task = self.tasks[next(reversed(self.tasks))]
        errors: list[ParadizeError] = [one.error for one in self.tasks.values() if one.error]
        if self.measured:
            names = {want.product: want.artifact or want.product for want in self.order.wants}
            named = {
                tier: {names.get(key, key): errors for key, errors in products.items()}
                for tier, products in self.measured.items()
            }
            errors += misses(named, budget, next(iter(self.order.sources.values()), None))
        told = list({str(error): error for error in errors}.values())
        task.error = told[0] if len(told) == 1 else GroupedError(told)
        task.status, task.products, task.data = "failed", {}, {}
        return task


def bake_orders(bench: Bench, orders: list[BakeJob], later: Later) -> tuple[list[Task], Tried]:
    """A task of each order, in the tier that is asked for or that `auto` finds; and what was tried, of those
    that `auto` decided and those beyond their budget, whose other tiers are measured too. Errors are in the
    tasks. later: what an earlier choice turned out to give."""
    budget = bench.context.scene.budget
    choices = [_Choice(order, bench.context.how.tier_of(order, bench.context.scene)) for order in orders]
    for choice in choices:
        first = ORDER[0] if choice.asked == AUTO else choice.asked
        choice.tasks[first] = bench.task(choice, first)
    fresh = [(choice, tier) for choice in choices for tier in choice.tasks]
    while fresh:
        bench.measure([choice.tasks[tier] for choice, tier in fresh])
        for choice, tier in fresh:
            if not choice.tasks[tier].error:
                products = choice.tasks[tier].products
                names = {want.product: want.artifact for want in choice.order.wants}
                errors = {
                    key: product.errors | later.get(names.get(key, ""), {}).get(tier, {})
                    for key, product in products.items()
                }
                choice.measured[tier] = limited(errors, budget)
        follow = [(choice, choice.following(budget)) for choice in choices]
        fresh = [(choice, tier) for choice, tier in follow if tier]
        for choice, tier in fresh:
            choice.tasks[tier] = bench.task(choice, tier)
    tasks = [choice.chosen(budget) for choice in choices]
    bench.take(tasks)
    return tasks, _told(choices, tasks)


def _told(choices: list[_Choice], tasks: list[Task]) -> Tried:
    found: Tried = {}
    for choice, task in zip(choices, tasks, strict=True):
        if choice.asked != AUTO and len(choice.tasks) == 1:
            continue
        taken = next(tier for tier, one in choice.tasks.items() if one is task)
        for want in task.wants:
            if want.kind:
                errors = {tier: errors.get(want.product, {}) for tier, errors in choice.measured.items()}
                found[want.artifact] = {"asked": choice.asked, "taken": taken, "errors": errors}
    return found
