"""The maps of one picture as KTX2 textures with all mips: one sweep for all, one more for du/dv."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from paradize.bakers.maps.rows import MapRows, encoding_errors, filter_errors, open_angles
from paradize.bakers.product import LevelErrors, MapProduct, beyond, flat_errors, texture_product
from paradize.data import Texture
from paradize.jobs.progress import report_step
from paradize.map_table import MAPS
from paradize.metrics.levels import dudv_levels, gloss_levels, normal_levels, value_levels
from paradize.scene.baker_settings import MapSettings
from paradize.stages.compress import LevelWriter, encode_rows, formats_of
from paradize.stages.dudv import DudvLevels
from paradize.stages.mips import gloss_rows, half_maps, unit_rows
from paradize.stages.sweep import level_count, sweep

if TYPE_CHECKING:
    from paradize.stages.sweep import Bundle

F32 = npt.NDArray[np.float32]
Mean = tuple[float, float]


def ktx2_maps(
    rows: MapRows, settings: MapSettings, *, tier: str, warnings: Sequence[str], measure: bool
) -> dict[str, MapProduct]:
    """The maps that `rows` was made for. Where the errors of a map's format exceed the budget, the next of
    its formats (map_table.py) is taken, but not for what the slope filter alone has beyond its limit.
    measure: False leaves out errors and budget."""
    height, width = rows.height_map.heights.shape
    first = -1 if settings.uncompressed else 0
    formats = {name: formats_of(name, height, width)[first:] for name in rows.names}
    report_step(f"mips of {', '.join(rows.names)}")
    textures, mean = map_textures(rows, {name: known[0] for name, known in formats.items()}, tier)
    done: dict[str, MapProduct] = {}
    offsets = [name for name in rows.names if _is_offset(name)]
    for name in [*textures, *offsets]:
        texture = textures.pop(name) if name in textures else dudv_texture(rows, mean)
        levels: LevelErrors = []
        errors: dict[str, float] = {}
        reason = None
        if measure:
            report_step(f"measuring {name}")
            fixed = filter_errors(rows.height_map) | open_angles(rows.height_map) if name == "normal" else {}
            limits = within_reach(settings.budget, fixed)
            levels, errors = _measured(name, rows, texture, fixed)
            for fmt in formats[name][1:]:
                over = beyond(errors, limits)
                if not over:
                    break
                reason = f"{texture.format} exceeds the budget: {', '.join(over)}"
                texture = map_textures(rows, {name: fmt}, tier)[0][name]
                levels, errors = _measured(name, rows, texture, fixed)
        behind = None if name == "height" else rows.height_map.filter_name
        done[name] = texture_product(
            texture, tier, settings.zstd, errors, levels, list(warnings), filter_name=behind, reason=reason
        )
        del texture
    return {name: done[name] for name in rows.names}


def within_reach(budget: Mapping[str, float], fixed: Mapping[str, float]) -> dict[str, float]:
    """The limits that a more exact format may keep: not those of what no format changes (`fixed`, by metric),
    nor those that the slope filter's part of the error exceeds by itself."""
    part = {"normal_mean_deg": "normal_filter_deg"}
    part |= {f"normal_{name}_deg": f"normal_filter_{name}_deg" for name in ("p99", "max")}
    return {
        metric: limit
        for metric, limit in budget.items()
        if metric not in fixed and fixed.get(part.get(metric, ""), 0.0) <= limit
    }


def _measured(
    name: str, rows: MapRows, texture: Texture, fixed: Mapping[str, float]
) -> tuple[LevelErrors, dict[str, float]]:
    """The errors of every level, and those of level 0 under the names of budgets."""
    levels = map_errors(name, rows, texture)
    more = {**fixed, **encoding_errors(texture, rows.height_map)} if name == "normal" else {}
    return levels, flat_errors(name, levels[0]) | more


def map_textures(rows: MapRows, formats: dict[str, str], tier: str) -> tuple[dict[str, Texture], Mean]:
    """The textures of some maps in the formats given, in one sweep, but for du/dv; for that, the mean of the
    normals' x and y."""
    height, width = rows.height_map.heights.shape
    count = level_count(height, width)
    writers = {
        name: LevelWriter(fmt, height, width, count) for name, fmt in formats.items() if not _is_offset(name)
    }
    top = np.zeros(2)

    def visit(level: int, first: int, bundle: Bundle) -> None:
        for name, writer in writers.items():
            writer.put(level, first, encode_rows(_values(name, bundle, level), writer.format, tier=tier))
        if level == count - 1 and "normal" in bundle:
            top[:] = bundle["normal"][0, 0, :2]

    names = (*writers, *(["normal"] if any(map(_is_offset, formats)) else []))
    sweep(height, width, lambda first, last: rows.bundle(names, first, last), visit, halve=half_maps)
    return {name: writer.texture() for name, writer in writers.items()}, (float(top[0]), float(top[1]))


def _values(name: str, bundle: Bundle, level: int) -> F32:
    """The values in a band of a map's level."""
    if name == "normal":
        return unit_rows(bundle, level)
    return gloss_rows(bundle, level) if name == "gloss" else bundle[name]


def dudv_texture(rows: MapRows, mean: Mean) -> Texture:
    """Du/dv of the same normals: x and y of their means, less the mean of all."""
    height, width = rows.height_map.heights.shape
    made = DudvLevels(height, width, level_count(height, width), mean)

    def visit(level: int, first: int, bundle: Bundle) -> None:
        made.put(level, first, bundle["normal"])

    sweep(height, width, lambda first, last: rows.bundle(("normal",), first, last), visit)
    return Texture(MAPS["dudv"].formats[0], width, height, tuple(made.levels()))


def map_errors(name: str, rows: MapRows, texture: Texture) -> LevelErrors:
    """The errors of every level."""
    if name == "gloss":
        return gloss_levels(texture, rows.truth("gloss"), rows.height_map)
    if MAPS[name].kind == "value":
        return value_levels(texture, rows.truth(name))
    measured = dudv_levels if _is_offset(name) else normal_levels
    return measured(texture, rows.height_map)


def _is_offset(name: str) -> bool:
    """Whether a map is made of another's mean: after the others, in a sweep of its own."""
    return MAPS[name].kind == "offset"
