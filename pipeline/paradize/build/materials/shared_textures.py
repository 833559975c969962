"""Textures of objects that turn out equal, byte by byte, are one artifact: one file, one texture in memory.

Map sets share what is known to be equal before it is baked (map_sets.py). Here it is found afterwards: two
models of one layout, or a picture that is the colour of one material and the emission of another.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from paradize.artifact import Artifact
from paradize.build.trim import RequiredDetail, finest_of
from paradize.map_table import MAPS, maps_of
from paradize.scene.budget import worst
from paradize.scene.map_sets import SceneMaps

_WORST = {"islands": max, "needed_texels": max, "level_in_use": max, "level_by_width": min}


def equal_textures(maps: SceneMaps, artifacts: Mapping[str, Artifact]) -> list[list[str]]:
    """Returns the names of object textures with equal bytes that are sampled alike, a list for each such
    file, in the order of the scene. Those with other gutters or another coarsest level stay apart."""
    alike: dict[Any, list[str]] = {}
    for map_set in maps.sets:
        for key in maps_of("object"):
            name = f"{map_set.name}_{key}"
            if name in artifacts:
                made = artifacts[name]
                bound = made.gutter["bound"] if made.gutter else None
                means = made.sha256, made.suffix, MAPS[key].kind, made.max_level, bound
                alike.setdefault(means, []).append(name)
    return [names for names in alike.values() if len(names) > 1]


def with_equal_detail(
    detail: RequiredDetail, palettes: Mapping[str, int], equal: Iterable[Sequence[str]]
) -> RequiredDetail:
    """Returns the required detail in which equal textures ask for the same: the most that any user needs.
    palettes: the level to which a palette is trimmed at least, by artifact."""
    detail = {
        name: required | {"level": max(required["level"], palettes.get(name, 0))}
        for name, required in detail.items()
    }
    for names in equal:
        if all(name in detail for name in names):
            most = finest_of([detail[name] for name in names])
            detail |= dict.fromkeys(names, most)
    return detail


def shared(artifacts: Mapping[str, Artifact], equal: Iterable[Sequence[str]]) -> dict[str, Artifact]:
    """Returns the artifacts, of equal ones only the first, with the names of the others and the worst that
    was measured of any."""
    kept = dict(artifacts)
    for first, *others in equal:
        same = [kept[first], *(kept.pop(name) for name in others)]
        kept[first] = replace(
            same[0],
            also=others,
            errors=_worst([artifact.errors for artifact in same]),
            levels=[_worst(levels) for levels in zip(*(artifact.levels for artifact in same), strict=True)],
            gutter=_worst_gutter([artifact.gutter for artifact in same if artifact.gutter]),
            over=list(dict.fromkeys(text for artifact in same for text in artifact.over)),
            status="baked" if any(artifact.status == "baked" for artifact in same) else same[0].status,
            seconds=round(sum(artifact.seconds for artifact in same), 3),
        )
    return kept


def _worst(errors: Sequence[Mapping[str, float]]) -> dict[str, float]:
    found: dict[str, float] = {}
    for measured in errors:
        for metric, value in measured.items():
            found[metric] = worst(metric, (value, found.get(metric, value)))
    return found


def _worst_gutter(gutters: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    if not gutters:
        return None
    widths = [gutter["width_texels"] for gutter in gutters if gutter["width_texels"] is not None]
    worst: dict[str, Any] = dict(gutters[0]) | {"width_texels": min(widths, default=None)}
    worst |= {key: pick(gutter[key] for gutter in gutters) for key, pick in _WORST.items()}
    for key in ("bleed_p99", "bleed_max"):
        worst[key] = [max(values) for values in zip(*(gutter[key] for gutter in gutters), strict=True)]
    return worst
