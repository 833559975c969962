"""The terrain, as one mesh or as a scene's tree of patches, and the camera path."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

from paradize.bakers.terrain.tiles import TilesProduct, bake_tiles
from paradize.data import Lod
from paradize.formats.glb.encode import encode_glb
from paradize.metrics.flight import flight_error
from paradize.metrics.terrain import terrain_error
from paradize.readers.heightmap import read_heightmap
from paradize.scene.baker_settings import TileSettings
from paradize.scene.flight import plan_flight
from paradize.scene.jobs import BakeJob
from paradize.scene.settings import Flight
from paradize.stages.terrain import terrain_mesh
from paradize.tiers import TIERS
from paradize.tradeoff.timing import Trial, TrialGroup, TrialResult, timed

_METRICS = ("terrain_max_m", "terrain_rms_m")


def tree_groups(job: BakeJob) -> list[TrialGroup]:
    """The group of a job of the baker "terrain", where tier `fast` is `balanced`."""
    arguments = {"path": job.sources["heightmap"], "settings": job.settings}
    trials = tuple(
        Trial(tier, tree_tier, arguments | {"tier": tier}, tier, {"tier": tier})
        for tier in ("balanced", "exact")
    )
    note = (
        "The tree of patches that the flight needs; the time includes the measuring that decides its splits."
    )
    artifact = job.outputs[0].artifact
    return [
        TrialGroup(
            name="terrain",
            stage="terrain",
            artifact=artifact,
            metrics=_METRICS,
            trials=trials,
            declared=("balanced", "exact"),
            note=note,
        )
    ]


def tree_tier(path: Path, settings: dict[str, Any], tier: str, runs: int | None) -> TrialResult:
    """Bakes all tiles of the tree, as files."""
    scratch = Path(tempfile.mkdtemp(prefix="paradize-"))

    def bake() -> TilesProduct:
        shutil.rmtree(scratch)
        scratch.mkdir()
        return bake_tiles(path, scratch, TileSettings(**settings), tier=tier)

    try:
        seconds, made = timed(bake, runs)
        size = sum(tile.file.stat().st_size for tile in made.tiles)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    known = [tile.errors for tile in made.tiles if "terrain_max_m" in tile.errors]
    errors = (
        {metric: max(errors_of_tile[metric] for errors_of_tile in known) for metric in _METRICS}
        if known
        else {}
    )
    patches = len(made.tables["patches"]["tile"])
    return TrialResult(seconds, [errors], size, f"{patches} patches in {len(made.tiles)} tiles")


def height_map_groups(
    path: Path,
    size_m: tuple[float, float],
    height_m: float | None,
    max_error_m: float,
    high_m: float,
    encoding: str,
) -> list[TrialGroup]:
    """The group of `paradize terrain` on a heightmap. height_m, encoding: as in read_heightmap. high_m: the
    range of the heights."""
    arguments = {
        "path": path,
        "size_m": size_m,
        "height_m": height_m,
        "max_error_m": max_error_m,
        "encoding": encoding,
    }
    trials = tuple(Trial(t, height_map_tier, arguments | {"tier": t}, t, {"tier": t}) for t in TIERS)
    note = (
        f"{size_m[0]:g} x {size_m[1]:g} m, {high_m:g} m high; fast and balanced keep a bound of "
        f"{max_error_m:g} m, fast with more triangles; exact has a vertex at every pixel."
    )
    return [
        TrialGroup(
            name=f"{path.stem} terrain",
            stage="terrain",
            artifact=path.stem,
            metrics=_METRICS,
            trials=trials,
            declared=TIERS,
            note=note,
        )
    ]


def height_map_tier(
    path: Path,
    size_m: tuple[float, float],
    height_m: float | None,
    max_error_m: float,
    encoding: str,
    tier: str,
    runs: int | None,
) -> TrialResult:
    """One mesh of the whole heightmap, against every pixel."""
    height_map, _ = read_heightmap(
        path, size_x_m=size_m[0], size_z_m=size_m[1], height_m=height_m, encoding=encoding
    )
    seconds, mesh = timed(lambda: terrain_mesh(height_map, tolerance_m=max_error_m, tier=tier), runs)
    error = terrain_error(mesh, height_map)
    errors = {"terrain_max_m": error.max_m, "terrain_rms_m": error.rms_m}
    size = len(encode_glb([Lod(mesh, 0.0, 0.0)], "measured"))
    return TrialResult(seconds, [errors], size, f"{len(mesh.triangles)} triangles")


def path_groups(flight: Flight) -> list[TrialGroup]:
    """The camera path, which has one tier."""
    trials = (Trial("only tier", path_tier, {"flight": flight}, None, {}),)
    metrics = ("path_ripple_max", "path_miss_m", "path_ripple_p99", "path_time_s")
    return [TrialGroup("camera path", "camera path", "flight", metrics, trials)]


def path_tier(flight: Flight, runs: int | None) -> TrialResult:
    """Makes the splines and the table of their arc length."""
    seconds, planned = timed(lambda: plan_flight(flight), runs)
    eye = [list(point.position) for point in flight.eye]
    target = [list(point.position) for point in flight.target]
    speeds = [point.speed for point in flight.eye]
    return TrialResult(seconds, [flight_error(planned.as_json(), eye, target, speeds)])
