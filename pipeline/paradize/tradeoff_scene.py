"""Runs the tiers of every stage that a scene uses, and says which of them spends the frame's error."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from paradize.bake import bake
from paradize.bake_looks import looks_of
from paradize.bake_tasks import How
from paradize.errors import GroupedError, ParadizeError
from paradize.require import require
from paradize.scene import load_scene
from paradize.tradeoff import Told, asked_in_worker, result, run_groups
from paradize.tradeoff_attribution import attribute, swaps
from paradize.tradeoff_plan import scene_groups

PLAYER = "paradize-player"


def find_player() -> Path | None:
    """The player beside this command, in build/bin of the same checkout, or on the path; None: there is
    none."""
    near = [Path(sys.argv[0]).parent, Path(sys.executable).parent, Path(sys.prefix).parent / "bin"]
    for folder in near:
        if os.access(folder / PLAYER, os.X_OK):
            return (folder / PLAYER).resolve()
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
        report = bake(path, room / "used", How(tier=tier))
        if report.errors:
            raise GroupedError(report.errors)
        rows = {row["name"]: row for row in report.artifacts}
        looks, _, _ = looks_of(scene, path)
        orders = require(scene, looks).orders
        asked = asked_in_worker(path.name, scene_groups, {"scene": scene, "orders": orders}, path)
        groups, warnings = run_groups(asked, rows, scene.budget.aim, runs, told)
        bars: list[dict[str, Any]] = []
        if player is not None:
            stages = swaps(orders, {name: row["tier"] for name, row in rows.items()})
            try:
                bars = attribute(path, scene, stages, room / "used", tier, player, room, told)
            except ParadizeError as error:
                warnings.append(f"which stage spends the frame's error was not measured: {error}")
    found = result(path, groups, warnings, time.monotonic() - start)
    return found | {"attribution": bars}
