"""The player's cut of a terrain, from scene.json's tables and words alone (FORMAT.md, "Terrain tiles")."""

from __future__ import annotations

import math
from typing import Any


def split_diamonds(
    tables: dict[str, Any], eye: tuple[float, float, float], pixels: float, near_m: float
) -> list[bool]:
    """Which diamonds an eye splits. pixels: picture height / (2 tan(fov / 2)) / lod_error_px."""
    patches, diamonds = tables["patches"], tables["diamonds"]
    made_by = patches["made_by"]
    owners: dict[int, list[int]] = {}
    for p, d in enumerate(patches["diamond"]):
        owners.setdefault(d, []).append(p)
    split = [False] * len(diamonds["level"])
    for d in range(len(split)):
        if all(made_by[p] == -1 or split[made_by[p]] for p in owners[d]):
            away = math.dist(eye, diamonds["center"][d]) - diamonds["radius_m"][d]
            split[d] = diamonds["error_m"][d] * pixels > max(near_m, away)
    return split


def drawn(tables: dict[str, Any], split: list[bool]) -> list[int]:
    """The rows of the patches of a cut."""
    patches = tables["patches"]
    pairs = zip(patches["made_by"], patches["diamond"], strict=True)
    return [p for p, (m, d) in enumerate(pairs) if (m == -1 or split[m]) and (d == -1 or not split[d])]
