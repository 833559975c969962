"""Measures the tiers of every stage that a scene uses, and which stage causes the error of the frame."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paradize.build.bake import bake
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.options import BuildOptions
from paradize.errors import GroupedError, ParadizeError, renamed
from paradize.jobs.progress import OnProgress
from paradize.scene.jobs import BakeJob
from paradize.scene.requirements import require
from paradize.scene.settings import Scene, load_scene
from paradize.tradeoff.attribution import attribute, swaps
from paradize.tradeoff.curve import Group
from paradize.tradeoff.plan import scene_groups
from paradize.tradeoff.tiers import plan_in_worker, result, run_groups
from paradize.tradeoff.words import conclude


def measure_scene(
    path: Path,
    *,
    tier: str | None = None,
    runs: int | None = None,
    player: Path | None = None,
    on_progress: OnProgress | None = None,
) -> dict[str, Any]:
    """Every tier of every stage that the scene uses, as the object of tradeoff.json.

    tier: the tier in use; None: the scene's own. runs: of each tier, as in measure_file. player: the program
    that draws pictures; None: nothing is drawn. Raises what `bake` raises.
    """
    start = time.monotonic()
    scene = load_scene(path)
    with tempfile.TemporaryDirectory(prefix="paradize-measure-") as name:
        scratch = Path(name)
        if on_progress:
            on_progress("baking the scene in the tiers in use", 0, 1)
        report = bake(path, scratch / "used", BuildOptions(tier=tier))
        if report.errors:
            raise GroupedError(report.errors)
        rows = {row["name"]: row for row in report.rows}
        found = find_map_sets(scene, path)
        jobs = require(scene, found.maps).jobs
        try:
            planned = plan_in_worker(path.name, scene_groups, {"scene": scene, "jobs": jobs}, path)
            groups, warnings = run_groups(planned, rows, scene.budget.aim, runs, on_progress)
        except ParadizeError as error:
            raise error.renamed(found.inside) from None
        bars: list[dict[str, Any]] = []
        if player is not None:
            drawn = _PlayerMeasurements(
                path=path,
                scene=scene,
                jobs=jobs,
                rows=rows,
                scratch=scratch,
                tier=tier,
                player=player,
                on_progress=on_progress,
            )
            try:
                bars = drawn.attribution()
            except ParadizeError as error:
                warnings.append(f"which stage causes the error of the frame was not measured: {error}")
            try:
                for group in drawn.qualities():
                    warnings += conclude(group)
                    groups.append(group)
            except ParadizeError as error:  # the groups measured before stay
                warnings.append(f"the rest of what the player draws was not measured: {error}")
    warnings = [str(renamed(text, found.inside)) for text in warnings]
    return result(path, groups, warnings, time.monotonic() - start) | {"attribution": bars}


@dataclass(frozen=True)
class _PlayerMeasurements:
    """Measures pictures and frames of a scene that is baked into `scratch`/used. rows: of its artifacts, by
    name."""

    path: Path
    scene: Scene
    jobs: list[BakeJob]
    rows: dict[str, dict[str, Any]]
    scratch: Path
    tier: str | None
    player: Path
    on_progress: OnProgress | None

    def attribution(self) -> list[dict[str, Any]]:
        """How much each stage changes the picture."""
        stages = swaps(self.jobs, {name: row["tier"] for name, row in self.rows.items()})
        used, scratch = self.scratch / "used", self.scratch
        return attribute(
            self.path,
            self.scene,
            stages=stages,
            used=used,
            tier=self.tier,
            player=self.player,
            scratch=scratch,
            on_progress=self.on_progress,
        )

    def qualities(self) -> Iterator[Group]:
        """The player's qualities and the formats of textures: time of a frame against its error."""
        from paradize.bakers.registry import BUDGET_FORMATS
        from paradize.tiers import TIERS
        from paradize.tradeoff.player import player_groups

        names = [job.name for job in self.jobs if job.baker in BUDGET_FORMATS]
        used = self.tier or self.scene.head.tier
        options = {
            tier: BuildOptions(tier=self.tier, tiers=dict.fromkeys(names, tier))
            for tier in TIERS
            if tier != used
        }
        options["uncompressed"] = BuildOptions(tier=self.tier, uncompressed=True)
        options["reference"] = BuildOptions(tier="exact", uncompressed=True, whole=True)
        for done, (name, option) in enumerate(options.items()):
            if self.on_progress:
                self.on_progress(f"textures baked {name}", done, len(options))
            report = bake(self.path, self.scratch / name, option)
            if report.errors:
                raise GroupedError(report.errors)
        return player_groups(
            self.player,
            self.scratch / "used",
            reference=self.scratch / "reference",
            variants={name: self.scratch / name for name in options if name != "reference"},
            used=used,
            on_progress=self.on_progress,
        )
