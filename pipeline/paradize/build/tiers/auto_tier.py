"""Chooses the tier of each job: the requested one, or for `auto` the cheapest whose measured errors are
inside the scene's budget. The measurements of every tier stay in the store, so no tier is tried twice.

Inside means inside the soft limits where they are given. Where no tier is, the cheapest inside the hard
limits is taken; where none is, that is an error. The order of tiers is declared, never timed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paradize.bakers import registry
from paradize.build.options import BuildContext
from paradize.build.tasks import Task, run_tasks, stored_products, take_from_store, task_of
from paradize.build.tiers.tier_choice import cheapest, inside, limited, misses
from paradize.build.tiers.tuned_settings import next_label, split_label
from paradize.errors import GroupedError, ParadizeError
from paradize.files import resolved
from paradize.scene.jobs import BakeJob
from paradize.scene.schema import Limits
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Stamp
from paradize.tiers import AUTO, FINER_FORMAT, LABELS, TIERS

# By artifact: the tier requested, the tier taken, and the errors of each tried tier in the metrics that the
# budget limits: {"requested", "taken", "errors": {tier: {metric: value}}}.
TriedTiers = dict[str, dict[str, Any]]

# By artifact, then tier: errors that can only be measured on several artifacts together.
LateErrors = dict[str, dict[str, dict[str, float]]]


@dataclass(frozen=True)
class TaskRunner:
    """Makes, bakes and looks up tasks. stamps: as in tasks.run_tasks. baked_s: seconds of the tasks that
    it baked, by key; a task is baked once."""

    context: BuildContext
    hash_cache: FileHashCache
    stamps: Mapping[Path, Stamp | None]
    baked_s: dict[str, float] = field(default_factory=dict)

    def task(self, choice: _Choice, label: str) -> Task:
        tier = split_label(label)[0] if label in FINER_FORMAT else label
        finer_format = choice.requested != AUTO or label in FINER_FORMAT
        raw = self.context.options.uncompressed
        return task_of(
            choice.job, self.hash_cache, tier, self.context.scene, finer_format=finer_format, uncompressed=raw
        )

    def measure(self, tasks: list[Task]) -> None:
        """Gets the tasks' errors from the store, or bakes the tasks."""
        if not self.context.options.force:
            self.context.store.expect(task.key for task in tasks)
        for task in tasks:
            products = (
                stored_products(self.context.store, task)
                if not self.context.options.force or task.key in self.baked_s
                else None
            )
            task.products, task.status = products or {}, "reused" if products else "baked"
        self.bake(task for task in tasks if task.status == "baked")

    def finish(self, tasks: list[Task]) -> None:
        """Gets the tasks' products from the store, or bakes the tasks."""
        for task in tasks:
            if task.status == "reused" and not take_from_store(self.context.store, task):
                task.status = "baked"
        self.bake(task for task in tasks if task.status == "baked" and not task.data and not task.error)
        for task in tasks:
            if task.key in self.baked_s and not task.error:  # also where an earlier choice did
                task.status, task.seconds = "baked", self.baked_s[task.key]

    def bake(self, tasks: Iterable[Task]) -> None:
        """Bakes tasks; of those with one key the first, whose products the others take."""
        batch = list(tasks)
        firsts = {task.key: task for task in reversed(batch)}
        self._run([task for task in batch if firsts[task.key] is task])
        others = [task for task in batch if firsts[task.key] is not task]
        self._run([task for task in others if not take_from_store(self.context.store, task)])
        self.baked_s.update({task.key: task.seconds for task in firsts.values() if not task.error})

    def _run(self, tasks: list[Task]) -> None:
        context = self.context
        root = resolved(context.scene_path).parent
        run_tasks(context.store, context.scratch, tasks, self.stamps, context.options, root)


@dataclass
class _Choice:
    """A job, the tier requested for it, and its tasks so far by label, in the order in which they were
    tried. measured: by tier, for each product by name, the errors that the budget limits."""

    job: BakeJob
    requested: str
    tasks: dict[str, Task] = field(default_factory=dict)
    measured: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)

    def next_tier(self, budget: Limits) -> str | None:
        """Returns the tier to try next; None if one is inside the budget, or none is left or would help."""
        if self.requested != AUTO and any(task.error for task in self.tasks.values()):
            return None
        tried = {
            label: label in self.measured and inside(self.measured[label], budget.aim) for label in self.tasks
        }
        finer = self.requested == AUTO and self.job.baker in registry.BUDGET_FORMATS
        tunes = self.requested == AUTO and 0.0 not in budget.aim.values()
        given = self.job.settings.get("max_error_m") if tunes else None
        return next_label(self.job.baker, LABELS if finer else TIERS, given, tried)

    def chosen(self, budget: Limits) -> Task:
        """Returns the task to take; one with an error if no tier is inside the budget."""
        tier = cheapest(self.measured, budget) if self.requested == AUTO else self.requested
        if tier is not None:
            return self.tasks[tier]
        task = self.tasks[next(reversed(self.tasks))]
        errors: list[ParadizeError] = [tried.error for tried in self.tasks.values() if tried.error]
        if self.measured:
            names = {output.product: output.artifact or output.product for output in self.job.outputs}
            by_artifact = {
                tier: {names.get(key, key): errors for key, errors in products.items()}
                for tier, products in self.measured.items()
            }
            errors += misses(by_artifact, budget, next(iter(self.job.sources.values()), None))
        distinct = list({str(error): error for error in errors}.values())
        task.error = distinct[0] if len(distinct) == 1 else GroupedError(distinct)
        task.status, task.products, task.data = "failed", {}, {}
        return task


def bake_jobs(
    runner: TaskRunner, jobs: list[BakeJob], late_errors: LateErrors
) -> tuple[list[Task], TriedTiers]:
    """Returns a task of each job, in the requested tier or the one that `auto` chose; and the tried tiers
    of those that `auto` chose or that exceed their budget. Errors are kept in the tasks. late_errors: of
    earlier choices, measured since."""
    budget = runner.context.scene.budget
    choices = [_Choice(job, runner.context.options.tier_of(job, runner.context.scene)) for job in jobs]
    for choice in choices:
        first = TIERS[0] if choice.requested == AUTO else choice.requested
        choice.tasks[first] = runner.task(choice, first)
    untried = [(choice, tier) for choice in choices for tier in choice.tasks]
    while untried:
        runner.measure([choice.tasks[tier] for choice, tier in untried])
        for choice, tier in untried:
            if not choice.tasks[tier].error:
                products = choice.tasks[tier].products
                names = {output.product: output.artifact for output in choice.job.outputs}
                errors = {
                    key: product.errors | late_errors.get(names.get(key, ""), {}).get(tier, {})
                    for key, product in products.items()
                }
                choice.measured[tier] = limited(errors, budget)
        follow = [(choice, choice.next_tier(budget)) for choice in choices]
        untried = [(choice, tier) for choice, tier in follow if tier]
        for choice, tier in untried:
            choice.tasks[tier] = runner.task(choice, tier)
    tasks = [choice.chosen(budget) for choice in choices]
    runner.finish(tasks)
    return tasks, _tried_tiers(choices, tasks)


def _tried_tiers(choices: list[_Choice], tasks: list[Task]) -> TriedTiers:
    tried: TriedTiers = {}
    for choice, task in zip(choices, tasks, strict=True):
        if choice.requested != AUTO and len(choice.tasks) == 1:
            continue
        taken = next(tier for tier, tried in choice.tasks.items() if tried is task)
        for output in task.outputs:
            if output.kind:
                errors = {tier: errors.get(output.product, {}) for tier, errors in choice.measured.items()}
                tried[output.artifact] = {"requested": choice.requested, "taken": taken, "errors": errors}
    return tried
