"""Checks that the terrain's tables in scene.json form one tree (see FORMAT.md, "Terrain tiles")."""

from __future__ import annotations

from typing import Any

from paradize.formats.scene.fields import Wrong


def check_tree(terrain: dict[str, Any]) -> None:
    """Checks that the tables fit each other: each diamond replaces patches of its level by patches of the
    next. Raises Wrong."""
    patches, diamonds = terrain["patches"], terrain["diamonds"]
    for place, table in (("patches", patches), ("diamonds", diamonds)):
        rows = len(table["level"])
        for key, column in table.items():
            if len(column) != rows:
                raise Wrong(f"terrain.{place}.{key}", f"has {len(column)} rows; level has {rows}")
        for i in range(1, rows):
            if table["level"][i] < table["level"][i - 1]:
                raise Wrong(f"terrain.{place}.level[{i}]", "is coarser than the row before")
    levels = diamonds["level"]
    for i, tile in enumerate(patches["tile"]):
        if tile >= len(terrain["tiles"]) or (i and tile < patches["tile"][i - 1]):
            raise Wrong(f"terrain.patches.tile[{i}]", f"is {tile}, out of range or order")
        level = patches["level"][i]
        for key, expected_level in (("made_by", level - 1), ("diamond", level)):
            d = patches[key][i]
            if d >= len(levels) or (d >= 0 and levels[d] != expected_level):
                raise Wrong(f"terrain.patches.{key}[{i}]", f"is {d}, not a diamond of level {expected_level}")
        if (patches["made_by"][i] < 0) != (level == 0):
            raise Wrong(f"terrain.patches.made_by[{i}]", "must be -1 exactly at level 0")
    made = set(patches["made_by"])
    replaced = set(patches["diamond"])
    for d in range(len(levels)):
        if d not in made or d not in replaced:
            raise Wrong(f"terrain.diamonds.level[{d}]", "is a diamond without patches on both sides")
    _check_bounds(patches, diamonds)


def _check_bounds(patches: dict[str, Any], diamonds: dict[str, Any]) -> None:
    """The error and sphere of a diamond must contain those of its patches and of the diamonds below it."""
    pairs = [(patches["diamond"][i], patches, i, f"patch {i}") for i in range(len(patches["level"]))]
    pairs += [
        (patches["made_by"][i], diamonds, patches["diamond"][i], f"diamond {patches['diamond'][i]}")
        for i in range(len(patches["level"]))
        if patches["diamond"][i] >= 0
    ]
    for d, table, i, name in pairs:
        if d < 0:
            continue
        if table["error_m"][i] > diamonds["error_m"][d]:
            raise Wrong(f"terrain.diamonds.error_m[{d}]", f"is less than that of {name} below")
        x, y, z = (a - b for a, b in zip(table["center"][i], diamonds["center"][d], strict=True))
        reach = (x * x + y * y + z * z) ** 0.5 + table["radius_m"][i]
        if reach > diamonds["radius_m"][d] * (1.0 + 1e-4) + 1e-9:
            raise Wrong(f"terrain.diamonds.radius_m[{d}]", f"does not contain {name} below")
