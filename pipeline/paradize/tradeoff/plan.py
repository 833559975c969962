"""Lists the groups to measure: what a scene requires, or everything that the bakers make of one file, with
their defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from paradize.errors import BakeError
from paradize.kinds import MODEL_SUFFIXES
from paradize.map_table import DERIVED
from paradize.readers.heightmap import guess_source, read_heightmap
from paradize.readers.image import read_image
from paradize.scene.baker_settings import ColorSettings, MapSettings, MeshSettings
from paradize.scene.jobs import BakeJob, Output
from paradize.scene.settings import Scene
from paradize.tradeoff.mesh import mesh_groups
from paradize.tradeoff.terrain import height_map_groups, path_groups, tree_groups
from paradize.tradeoff.texture import authored_groups, color_groups, map_groups, sky_groups
from paradize.tradeoff.timing import TrialGroup

_GROUPS = {
    "mesh": mesh_groups,
    "terrain": tree_groups,
    "color": color_groups,
    "maps": map_groups,
    "authored": authored_groups,
    "cubemap": sky_groups,
}
PIXEL_M = 1.0  # metres between the pixels of a heightmap without --size
HEIGHT_SHARE = 0.1  # height of a heightmap without --height, as a share of its longer side


@dataclass(frozen=True)
class FileOptions:
    """The properties that a file does not state itself. source: "color", "height" or "auto" (as
    readers/heightmap guesses). size_m, height_m, max_error_m: of a heightmap as terrain; None: from PIXEL_M,
    from HEIGHT_SHARE unless the file holds metres, a thousandth of the height. encoding: as
    read_heightmap takes it; other than "grey": the file is a terrain alone."""

    source: str = "auto"
    size_m: tuple[float, float] | None = None
    height_m: float | None = None
    max_error_m: float | None = None
    encoding: str = "grey"


def scene_groups(scene: Scene, jobs: list[BakeJob]) -> list[TrialGroup]:
    """The groups of a scene's jobs. A baker without stages (sound) has none."""
    groups = [group for job in jobs for group in _GROUPS.get(job.baker, _nothing)(job)]
    return [*groups, *path_groups(scene.flight)]


def _nothing(job: BakeJob) -> list[TrialGroup]:
    del job
    return []


def file_groups(path: Path, options: FileOptions) -> list[TrialGroup]:
    """The groups of a model, a colour map or a heightmap. Raises SourceError if it cannot be read, BakeError
    for options that do not fit it."""
    if path.suffix.lower() in MODEL_SUFFIXES:
        if options != FileOptions():
            mend = "leave out --from, --size, --height, --max-error and --encoding"
            raise BakeError("is a model; sizes and heights are those of a picture", file=path, mend=mend)
        return mesh_groups(_mesh_job(path), alone=True)
    image = read_image(path, finite=False)
    tile = options.encoding != "grey"
    kind = options.source
    if kind == "auto":
        kind = "height" if tile else guess_source(image)[0]
    rows, columns = image.values.shape[:2]
    if kind == "color":
        if tile or options.size_m or options.height_m or options.max_error_m is not None:
            mend = "say --from height, or leave out --size, --height, --max-error and --encoding"
            raise BakeError("is a colour map, which has no size in metres", file=path, mend=mend)
        return [*color_groups(_color_job(path)), *map_groups(_map_job(path, kind))]
    size = options.size_m or (PIXEL_M * max(columns - 1, 1), PIXEL_M * max(rows - 1, 1))
    height = options.height_m
    if height is None and image.top is not None and not tile:
        height = HEIGHT_SHARE * max(size)
    high = abs(height or 0.0)
    if image.top is None or tile:
        height_map, _ = read_heightmap(
            path, size_x_m=size[0], size_z_m=size[1], height_m=None, encoding=options.encoding
        )
        high = float(np.ptp(height_map.heights_m))
    bound = high / 1000.0 if options.max_error_m is None else options.max_error_m
    terrain = height_map_groups(path, size, height, bound, high, options.encoding)
    return terrain if tile else [*terrain, *map_groups(_map_job(path, kind))]


def _mesh_job(path: Path) -> BakeJob:
    """The job of `paradize mesh`; a model without texture coordinates gets them, as with --atlas."""
    settings = asdict(MeshSettings(atlas=True, painted=True))
    return BakeJob(
        f"{path.stem} mesh", "mesh", {"mesh": path}, settings, (Output(path.stem, "mesh", "mesh", ""),)
    )


def _color_job(path: Path) -> BakeJob:
    """The job of a colour texture by itself."""
    settings = asdict(ColorSettings(wrap="clamp"))
    output = Output(f"{path.stem}_color", "texture", "color", "")
    return BakeJob(f"{path.stem} colour", "color", {"image": path}, settings, (output,))


def _map_job(path: Path, source: str) -> BakeJob:
    """The job of `paradize maps`."""
    settings = asdict(MapSettings(source=source))
    outputs = tuple(Output(f"{path.stem}_{name}", "texture", name, "") for name in DERIVED)
    return BakeJob(f"{path.stem} maps", "maps", {"image": path}, settings, outputs)


def file_rows(groups: list[TrialGroup], tier: str) -> Mapping[str, Mapping[str, str]]:
    """The rows of the artifacts as a bake of the file in this tier would give them. In a group of formats:
    the format that is named after the tier alone."""
    rows: dict[str, dict[str, str]] = {}
    for group in groups:
        row = rows.setdefault(group.artifact, {"tier": tier})
        for trial in group.trials:
            fmt = (trial.row or {}).get("format")
            if fmt and (trial.tier == tier or "format" not in row):
                row["format"] = fmt
    return rows
