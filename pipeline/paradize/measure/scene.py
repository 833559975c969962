"""Runs the tiers of every stage that a scene uses, and says which of them spends the frame's error."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paradize.build.bake import bake
from paradize.build.material_colors import material_colors_of
from paradize.build.options import BuildOptions
from paradize.errors import GroupedError, ParadizeError
from paradize.files import resolved
from paradize.measure.attribution import attribute, swaps
from paradize.measure.curve import Group
from paradize.measure.plan import scene_groups
from paradize.measure.tiers import Told, asked_in_worker, result, run_groups
from paradize.measure.words import judge
from paradize.scene.requirements import BakeJob, require
from paradize.scene.settings import Scene, load_scene

PLAYER = "paradize-player"


def find_player() -> Path | None:
    """The player beside this command, in build/bin of the same checkout, or on the path; None: there is
    none."""
    near = [Path(sys.argv[0]).parent, Path(sys.executable).parent, Path(sys.prefix).parent / "bin"]
    for folder in near:
        if os.access(folder / PLAYER, os.X_OK):
            return resolved(folder / PLAYER)
    found = shutil.which(PLAYER)
    return None if found is None else Path(found)


def measure_scene(
    path: Path,
    *,
    tier: str | None = None,
    runs: int | None = None,
    player: Path | None = None,
    told: Told | None = None,
) -> dict[str, Any]:
    """Every tier of every stage that the scene uses, as the object of tradeoff.json.

    tier: the one in use; None: the scene's own. runs: of each tier, as measure_file takes it. player: draws
    the pictures that attribution compares; None: there is none. Raises what baking raises.
    """
    start = time.monotonic()
    scene = load_scene(path)
    with tempfile.TemporaryDirectory(prefix="paradize-measure-") as name:
        room = Path(name)
        if told:
            told("baking the scene in the tiers in use", 0, 1)
        report = bake(path, room / "used", BuildOptions(tier=tier))
        if report.errors:
            raise GroupedError(report.errors)
        rows = {row["name"]: row for row in report.rows}
        looks, _, _ = material_colors_of(scene, path)
        orders = require(scene, looks).orders
        asked = asked_in_worker(path.name, scene_groups, {"scene": scene, "orders": orders}, path)
        groups, warnings = run_groups(asked, rows, scene.budget.aim, runs, told)
        bars: list[dict[str, Any]] = []
        if player is not None:
            drawn = _Drawn(path, scene, orders, rows, room, tier, player, told)
            try:
                bars = drawn.attribution()
            except ParadizeError as error:
                warnings.append(f"which stage spends the frame's error was not measured: {error}")
            try:
                for group in drawn.trades():
                    warnings += judge(group)
                    groups.append(group)
            except ParadizeError as error:  # what was measured before stays
                warnings.append(f"the rest of what the player draws was not measured: {error}")
    found = result(path, groups, warnings, time.monotonic() - start)
    return found | {"attribution": bars}


@dataclass(frozen=True)
class _Drawn:
    """A scene baked into `room`/used, and the player that draws it. rows: of its artifacts, by name."""

    path: Path
    scene: Scene
    orders: list[BakeJob]
    rows: dict[str, dict[str, Any]]
    room: Path
    tier: str | None
    player: Path
    told: Told | None

    def attribution(self) -> list[dict[str, Any]]:
        """Which stage spends the frame's error."""
        stages = swaps(self.orders, {name: row["tier"] for name, row in self.rows.items()})
        used = self.room / "used"
        return attribute(self.path, self.scene, stages, used, self.tier, self.player, self.room, self.told)

    def trades(self) -> Iterator[Group]:
        """The player's qualities, and how textures are stored, as time of a frame against its error."""
        from paradize.measure.player import TIERS, player_groups

        tasks = [order.name for order in self.orders if order.maker in ("color", "maps")]
        used = self.tier or self.scene.head.tier
        hows = {
            tier: BuildOptions(tier=self.tier, tiers=dict.fromkeys(tasks, tier))
            for tier in TIERS
            if tier != used
        }
        hows["uncompressed"] = BuildOptions(tier=self.tier, uncompressed=True)
        hows["reference"] = BuildOptions(tier="exact", uncompressed=True, whole=True)
        for done, (name, how) in enumerate(hows.items()):
            if self.told:
                self.told(f"textures baked {name}", done, len(hows))
            report = bake(self.path, self.room / name, how)
            if report.errors:
                raise GroupedError(report.errors)
        return player_groups(
            self.player,
            self.room / "used",
            reference=self.room / "reference",
            variants={name: self.room / name for name in hows if name != "reference"},
            used=used,
            told=self.told,
        )
