"""A source -> the groups to be measured: what a scene requires, or what the bakers make of one file.

A file is asked about as a scene would that required everything of it, with the bakers' own defaults.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from paradize.errors import BakeError
from paradize.maps import DERIVED
from paradize.measure.mesh import mesh_groups
from paradize.measure.terrain import field_groups, path_groups, tree_groups
from paradize.measure.texture import color_groups, map_groups, sky_groups
from paradize.measure.timing import TrialGroup
from paradize.readers.heightmap import guessed_source, read_heightmap
from paradize.readers.image import read_image
from paradize.scene.baker_settings import MeshSettings
from paradize.scene.requirements import BakeJob, Output
from paradize.scene.settings import Relief, Scene

_GROUPS = {
    "mesh": mesh_groups,
    "terrain": tree_groups,
    "color": color_groups,
    "maps": map_groups,
    "cubemap": sky_groups,
}
PIXEL_M = 1.0  # a heightmap without a size has pixels so far apart
HEIGHT_SHARE = 0.1  # and stands this share of its longer side high


@dataclass(frozen=True)
class FileOptions:
    """What a file does not tell of itself. source: "color", "height" or "auto": as readers/heightmap guesses.
    size_m, height_m, max_error_m: of a heightmap as terrain; None: PIXEL_M, HEIGHT_SHARE where the file does
    not hold metres, a thousandth of the height."""

    source: str = "auto"
    size_m: tuple[float, float] | None = None
    height_m: float | None = None
    max_error_m: float | None = None


def scene_groups(scene: Scene, orders: list[BakeJob]) -> list[TrialGroup]:
    """The groups of a scene's orders; makers that have no stage (sound) have none."""
    found = [group for order in orders for group in _GROUPS.get(order.maker, _nothing)(order)]
    return [*found, *path_groups(scene.flight)]


def _nothing(order: BakeJob) -> list[TrialGroup]:
    del order
    return []


def file_groups(path: Path, options: FileOptions) -> list[TrialGroup]:
    """The groups of an OBJ, a colour map or a heightmap. Raises SourceError for what cannot be read,
    BakeError for options that do not fit it."""
    if path.suffix.lower() == ".obj":
        if options != FileOptions():
            mend = "leave out --from, --size, --height and --max-error"
            raise BakeError("is a model; sizes and heights are those of a picture", file=path, mend=mend)
        return mesh_groups(_mesh_order(path))
    image = read_image(path, finite=False)
    kind = guessed_source(image)[0] if options.source == "auto" else options.source
    name, rows, columns = path.stem, *image.values.shape[:2]
    if kind == "color":
        if options.size_m or options.height_m or options.max_error_m is not None:
            mend = "say --from height, or leave out --size, --height and --max-error"
            raise BakeError("is a colour map, which has no size in metres", file=path, mend=mend)
        want = Output(f"{name}_color", "texture", "color", "")
        order = BakeJob(
            f"{name} colour", "color", {"image": path}, {"wrap": "clamp", "alpha_cutoff": 0.5}, (want,)
        )
        return [*color_groups(order), *map_groups(_map_order(path, kind))]
    size = options.size_m or (PIXEL_M * max(columns - 1, 1), PIXEL_M * max(rows - 1, 1))
    height = options.height_m
    if height is None and image.top is not None:
        height = HEIGHT_SHARE * max(size)
    high = abs(height or 0.0)
    if image.top is None:
        field, _ = read_heightmap(path, size_x_m=size[0], size_z_m=size[1], height_m=None)
        high = float(np.ptp(field.heights_m))
    bound = high / 1000.0 if options.max_error_m is None else options.max_error_m
    return [*field_groups(path, size, height, bound, high), *map_groups(_map_order(path, kind))]


def _mesh_order(path: Path) -> BakeJob:
    """As `paradize mesh --atlas` has it."""
    settings = asdict(MeshSettings(atlas=True))
    return BakeJob(
        f"{path.stem} mesh", "mesh", {"mesh": path}, settings, (Output(path.stem, "mesh", "mesh", ""),)
    )


def _map_order(path: Path, source: str) -> BakeJob:
    """As `paradize maps` has it."""
    settings = {"source": source, "strength": 1.0, "relief": asdict(Relief()), "wrap": "clamp"}
    wants = tuple(Output(f"{path.stem}_{name}", "texture", name, "") for name in DERIVED)
    return BakeJob(f"{path.stem} maps", "maps", {"image": path}, settings, wants)


def file_rows(groups: list[TrialGroup], tier: str) -> Mapping[str, Mapping[str, str]]:
    """What the rows of artifacts would say if a file were baked in a tier: of each format group the format
    that bears the tier's name alone."""
    rows: dict[str, dict[str, str]] = {}
    for group in groups:
        row = rows.setdefault(group.artifact, {"tier": tier})
        for attempt in group.tries:
            fmt = (attempt.row or {}).get("format")
            if fmt and (attempt.tier == tier or "format" not in row):
                row["format"] = fmt
    return rows
