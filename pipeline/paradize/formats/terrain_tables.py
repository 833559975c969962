"""Whether the terrain's tables in scene.json make one tree (see FORMAT.md, "Terrain tiles")."""

from __future__ import annotations

from typing import Any

from paradize.formats.scene_fields import Wrong


def check_tree(terrain: dict[str, Any]) -> None:
    """The terrain's tables fit each other: every diamond splits patches of its level into some of the next.
    Raises Wrong."""
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
        for key, other in (("made_by", level - 1), ("diamond", level)):
            d = patches[key][i]
            if d >= len(levels) or (d >= 0 and levels[d] != other):
                raise Wrong(f"terrain.patches.{key}[{i}]", f"is {d}, no diamond of level {other}")
        if (patches["made_by"][i] < 0) != (level == 0):
            raise Wrong(f"terrain.patches.made_by[{i}]", "is none where the level is not 0, or the reverse")
    made = set(patches["made_by"])
    replaced = set(patches["diamond"])
    for d in range(len(levels)):
        if d not in made or d not in replaced:
            raise Wrong(f"terrain.diamonds.level[{d}]", "is of a diamond without patches on both sides")
    _holds(patches, diamonds)


def _holds(patches: dict[str, Any], diamonds: dict[str, Any]) -> None:
    """A diamond's error and sphere are not less than those of its patches, and of the diamonds below it."""
    inner = [(patches["diamond"][i], patches, i, f"patch {i}") for i in range(len(patches["level"]))]
    inner += [
        (patches["made_by"][i], diamonds, patches["diamond"][i], f"diamond {patches['diamond'][i]}")
        for i in range(len(patches["level"]))
        if patches["diamond"][i] >= 0
    ]
    for d, table, i, name in inner:
        if d < 0:
            continue
        if table["error_m"][i] > diamonds["error_m"][d]:
            raise Wrong(f"terrain.diamonds.error_m[{d}]", f"is less than that of {name} below")
        x, y, z = (a - b for a, b in zip(table["center"][i], diamonds["center"][d], strict=True))
        reach = (x * x + y * y + z * z) ** 0.5 + table["radius_m"][i]
        if reach > diamonds["radius_m"][d] * (1.0 + 1e-4) + 1e-9:
            raise Wrong(f"terrain.diamonds.radius_m[{d}]", f"does not reach round {name} below")
