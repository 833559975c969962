"""The shapes of entries that the store keeps of a bake.

An entry with a valid seal may still have another shape, from another version of Paradize. It then counts as
missing and is made again.
"""

from __future__ import annotations

from typing import Any, TypeGuard

from paradize.formats.scene.fields import (
    Check,
    Wrong,
    file_stem,
    flag,
    list_of,
    map_of,
    number,
    or_null,
    sha256,
    table,
    text,
    whole,
)
from paradize.formats.scene.schema import GUTTER

_real, _positive = number(), number(0.0)
_level = whole(0, 31)

PRODUCTS = map_of(
    table(
        sha256=sha256,
        suffix=file_stem,
        tier=text,
        errors=map_of(_real),
        levels=list_of(map_of(_real)),
        format=or_null(text),
        reason=or_null(text),
        filter=or_null(text),
        warnings=list_of(text),
        constant=or_null(list_of(_real)),
    )
)
_MAP_GUTTERS = table(**GUTTER, max_level=or_null(_level))
GUTTERS = table(repeat=flag, limits=map_of(or_null(_positive)), maps=map_of(or_null(_MAP_GUTTERS)))
LOD_NORMAL_ERRORS = table(
    levels=list_of(table(mapped_mean_deg=_positive, mapped_p99_deg=_positive, mapped_max_deg=_positive))
)
LODS_SEEN = table(
    levels=list_of(
        table(
            seen_px=_positive,
            seen_p99_deg=_positive,
            seen_mean_deg=_positive,
            seen_silhouette=_positive,
            seen_flip=_positive,
            switch_m=or_null(_positive),
        )
    )
)
SIGHTINGS = map_of(table(first_s=_positive, pixel_m=or_null(_positive)))
RIPPLES = table(circles=list_of(list_of(_real, min_size=3, max_size=3)))
PIXELS = table(pixel_m=or_null(_positive))
_detail = table(
    level=_level,
    texels=or_null(_positive),
    second_s=or_null(_positive),
    view=or_null(text),
    levels_s=list_of(or_null(_positive)),
)


def _detail_and_others(value: Any, place: str) -> None:
    """The required detail of an artifact; of a texture also "others", the same without its flat triangles."""
    rest = value
    if isinstance(value, dict) and "others" in value:
        rest = dict(value)
        _detail(rest.pop("others"), f"{place}.others")
    _detail(rest, place)


REQUIRED_DETAIL = map_of(_detail_and_others)
FLAT = map_of(_level)
PALETTES = map_of(table(level=_level, max_level=_level, level_psnr_db=_positive))
SECONDS = map_of(_positive)


def fits(entry: Any, shape: Check) -> TypeGuard[dict[str, Any]]:
    """Whether an entry exists and has this shape."""
    try:
        shape(entry, "")
    except Wrong:
        return False
    return True
