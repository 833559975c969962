# ruff: noqa: RUF009 (the calls in the dataclasses make their fields)
"""The terrain: its heights, its ground maps and its wet sand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from paradize.scene import ranges
from paradize.scene.schema import FAR, choice, flag, number, number_or, source, table, vector, whole
from paradize.scene.settings.relief import Relief


@dataclass(frozen=True, kw_only=True)
class Terrain:
    heightmap: Path = source(
        meaning="grey picture, tile, .hgt, .asc or square .raw, .r16, .r32 of heights; a pixel is a vertex"
    )
    size_m: tuple[float, float] = vector(
        size=2, **ranges.SIZE_M, unit="m", meaning="x and z, from the first to the last pixel"
    )

    encoding: str = choice(
        "grey",
        among=ranges.ENCODINGS,
        meaning="how the heightmap holds heights: as grey, or as digits in the colours of a web map's tile",
    )
    height_m: float | None = number(
        None,
        **ranges.HEIGHT_M,
        unit="m",
        meaning="height of white above black; metres (floats, signed integers, .hgt, .asc) need none",
    )
    height_scale: float = number(1.0, **ranges.HEIGHT_SCALE, meaning="factor on the heights, also on metres")
    nodata: float | str = number_or(
        ("auto", "none"),
        low=-1e39,
        high=1e39,
        meaning="value of pixels without a height; auto: as the file says",
    )
    base_m: float = number(0.0, **ranges.HEIGHT_M, unit="m", meaning="y of black")
    max_error_m: float = number(
        0.03,
        **ranges.MAX_ERROR_M,
        unit="m",
        meaning="largest vertical error of the mesh; 0: a vertex at every pixel",
    )
    patch_px: int = whole(
        128, low=8, high=256, unit="pixels", meaning="side of the finest cells of the patch tree"
    )
    quantise: bool = flag(False, meaning="16-bit vertices, inside max_error_m")
    tile_mb: float = number(64.0, low=0.01, high=64.0, unit="MB", meaning="largest size of a file of patches")
    sand_color: Path = source(meaning="tileable colour map of the ground")
    sand_repeat: float = number(1.0, low=1e-3, high=1e5, meaning="how often the sand repeats along x")
    sand_height: Path | None = source(
        None, meaning="heights of the sand; without it they come from sand_color"
    )
    sand_strength: float = number(
        0.0, **ranges.STRENGTH, unit="% of the width", meaning="height of full white; 0: no normal map"
    )
    sand_relief: Relief = table(Relief, Relief, meaning="How the picture becomes heights.")
    effect_color: Path | None = source(
        None, meaning="colour map over the whole terrain, shown below mix_low_m"
    )
    effect_height: Path | None = source(
        None, meaning="heights of the effect map; without it they come from effect_color"
    )
    effect_strength: float = number(
        1.0, **ranges.STRENGTH, unit="% of the width", meaning="height of full white; 0: no normal map"
    )
    effect_relief: Relief = table(Relief, Relief, meaning="How the picture becomes heights.")
    mix_low_m: float = number(
        0.0, low=-FAR, high=FAR, unit="m", meaning="below this height only the effect map shows"
    )
    mix_high_m: float = number(
        2.0, low=-FAR, high=FAR, unit="m", meaning="above this height only the sand shows"
    )
    specular: float = number(0.05, low=0.0, high=10.0, meaning="intensity of highlights")
    smoothness: float = number(0.2, low=0.0, high=1.0, meaning="0: rough, 1: mirror")
    wet_high_m: float = number(
        0.5, low=0.0, high=FAR, unit="m", meaning="sand is wet up to this height above the water"
    )
    wet_darkness: float = number(0.4, low=0.0, high=1.0, meaning="how much darker wet sand is")
    wet_smoothness: float = number(0.6, low=0.0, high=1.0, meaning="smoothness of wet sand")
