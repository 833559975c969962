"""The tiers of the terrain, as one mesh or as a scene's tree of patches, and of the camera's path."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

from paradize.bakers.terrain.tiles import TilesProduct, bake_tiles
from paradize.data import Lod
from paradize.formats.glb.encode import encode_glb
from paradize.measure.timing import Trial, TrialGroup, TrialResult, timed
from paradize.metrics.flight import flight_error
from paradize.metrics.terrain import terrain_error
from paradize.readers.heightmap import read_heightmap
from paradize.scene.flight import plan_flight
from paradize.scene.requirements import BakeJob
from paradize.scene.settings import Flight
from paradize.stages.terrain import terrain_mesh

_METRICS = ("terrain_max_m", "terrain_rms_m")


def tree_groups(order: BakeJob) -> list[TrialGroup]:
    """What there is to be measured of an order of the maker "terrain": `fast` is `balanced` there."""
    given = {"path": order.sources["heightmap"], "settings": order.settings}
    tries = tuple(
        Trial(tier, tree_tier, given | {"tier": tier}, tier, {"tier": tier}) for tier in ("balanced", "exact")
    )
    note = (
        "The tree of patches that the flight asks for; the time holds the measuring that decides its splits."
    )
    artifact = order.wants[0].artifact
    return [TrialGroup("terrain", "terrain", artifact, _METRICS, tries, ("balanced", "exact"), note)]


def tree_tier(path: Path, settings: dict[str, Any], tier: str, runs: int | None) -> TrialResult:
    """All tiles of the tree, as files."""
    room = Path(tempfile.mkdtemp(prefix="paradize-"))

    def bake() -> TilesProduct:
        shutil.rmtree(room)
        room.mkdir()
        return bake_tiles(path, room, tier=tier, **settings)

    try:
        seconds, made = timed(bake, runs)
        size = sum(tile.file.stat().st_size for tile in made.tiles)
    finally:
        shutil.rmtree(room, ignore_errors=True)
    known = [tile.errors for tile in made.tiles if "terrain_max_m" in tile.errors]
    errors = {metric: max(told[metric] for told in known) for metric in _METRICS} if known else {}
    patches = len(made.tables["patches"]["tile"])
    return TrialResult(seconds, [errors], size, f"{patches} patches in {len(made.tiles)} tiles")


def field_groups(
    path: Path, size_m: tuple[float, float], height_m: float | None, max_error_m: float, high_m: float
) -> list[TrialGroup]:
    """The tiers of `paradize terrain` on a heightmap. height_m: as read_heightmap takes it. high_m: what the
    heights span."""
    given = {"path": path, "size_m": size_m, "height_m": height_m, "max_error_m": max_error_m}
    tiers = ("fast", "balanced", "exact")
    tries = tuple(Trial(t, field_tier, given | {"tier": t}, t, {"tier": t}) for t in tiers)
    note = (
        f"{size_m[0]:g} x {size_m[1]:g} m, {high_m:g} m high; fast and balanced keep a bound of "
        f"{max_error_m:g} m, fast with more triangles; exact passes through every pixel."
    )
    return [TrialGroup(f"{path.stem} terrain", "terrain", path.stem, _METRICS, tries, tiers, note)]


def field_tier(
    path: Path,
    size_m: tuple[float, float],
    height_m: float | None,
    max_error_m: float,
    tier: str,
    runs: int | None,
) -> TrialResult:
    """One mesh of the whole field, against every pixel."""
    ground, _ = read_heightmap(path, size_x_m=size_m[0], size_z_m=size_m[1], height_m=height_m, base_m=0.0)
    seconds, mesh = timed(lambda: terrain_mesh(ground, tolerance_m=max_error_m, tier=tier), runs)
    error = terrain_error(mesh, ground)
    errors = {"terrain_max_m": error.max_m, "terrain_rms_m": error.rms_m}
    size = len(encode_glb([Lod(mesh, 0.0, 0.0)], "measured"))
    return TrialResult(seconds, [errors], size, f"{len(mesh.triangles)} triangles")


def path_groups(flight: Flight) -> list[TrialGroup]:
    """The camera's path, which has one tier."""
    tries = (Trial("the one there is", path_tier, {"flight": flight}, None, {}),)
    metrics = ("path_ripple_max", "path_miss_m", "path_ripple_p99", "path_time_s")
    return [TrialGroup("camera path", "camera path", "flight", metrics, tries)]


def path_tier(flight: Flight, runs: int | None) -> TrialResult:
    """Splines and the table of their arc length."""
    seconds, planned = timed(lambda: plan_flight(flight), runs)
    eye = [list(point.position) for point in flight.eye]
    target = [list(point.position) for point in flight.target]
    speeds = [point.speed for point in flight.eye]
    return TrialResult(seconds, [flight_error(planned.as_json(), eye, target, speeds)])
