"""Reads what a GeoTIFF says about its numbers: the no-data value, scale and offset, the unit; and which way
its rows run.

Sources: GDAL, "GTiff driver" (tags 42112, metadata as XML, and 42113, no data as text); OGC 19-008r4,
"GeoTIFF 1.1", keys 4096 to 4099 (units as EPSG codes), tag 34264 (from pixels to the map).
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from paradize.files import open_file
from paradize.readers.tiff import first_directory

if TYPE_CHECKING:
    from pathlib import Path

_KEYS, _METADATA, _NODATA, _TRANSFORM = 34735, 42112, 42113, 34264
_VERTICAL_UNITS = 4099
_METRE, _FOOT, _SURVEY_FOOT = 1.0, 0.3048, 1200.0 / 3937.0
_EPSG = {9001: ("metre", _METRE), 9002: ("foot", _FOOT), 9003: ("US survey foot", _SURVEY_FOOT)}
_NAMES = {
    **dict.fromkeys(("m", "metre", "meter", "metres", "meters"), _EPSG[9001]),
    **dict.fromkeys(("ft", "foot", "feet", "international foot"), _EPSG[9002]),
    **dict.fromkeys(("us-ft", "ftus", "sfoot", "us survey foot", "foot_us", "us_survey_foot"), _EPSG[9003]),
}
_ITEM = re.compile(r"<Item([^<>]*)>([^<>]*)</Item>")


@dataclass(frozen=True)
class GeoTiffTags:
    """nodata: the number that means "no height". scale, offset: height = number * scale + offset, in units of
    unit_m metres. words: scale, offset and unit as text for messages; "" where the file gives none, and its
    numbers are used as in any other file. south_up: its first row is the southernmost."""

    nodata: float | None = None
    scale: float = 1.0
    offset: float = 0.0
    unit_m: float = 1.0
    words: str = ""
    south_up: bool = False


def read_geotiff_tags(path: Path) -> GeoTiffTags:
    """Reads the first directory of a TIFF. Returns defaults for other files and for damaged tags."""
    try:
        with open_file(path) as file:
            tags = first_directory(file, (_KEYS, _METADATA, _NODATA, _TRANSFORM))
    except (OSError, ValueError, struct.error):
        return GeoTiffTags()
    texts = {tag: value.decode("utf-8", "replace") for tag, value in tags.items() if isinstance(value, bytes)}
    roles = {}
    for attributes, text in _ITEM.findall(texts.get(_METADATA, "")):
        if (role := re.search(r'role="(\w+)"', attributes)) and re.search(r'sample="0"', attributes):
            roles[role[1]] = text.strip()
    scale, offset = _number(roles.get("scale")), _number(roles.get("offset"))
    keys = tags.get(_KEYS, ())
    codes = [int(keys[k + 3]) for k in range(4, len(keys) - 3, 4) if keys[k] == _VERTICAL_UNITS]
    unit = _NAMES.get(roles.get("unittype", "").lower()) or _EPSG.get(codes[0] if codes else 0)
    numbers = {"scale": scale, "offset": offset}
    parts = [f"{name} {number:g}" for name, number in numbers.items() if number is not None]
    parts += [f"unit {unit[0]}"] if unit else []
    return GeoTiffTags(
        _number(texts.get(_NODATA, "").rstrip("\0 ")),
        1.0 if scale is None else scale,
        0.0 if offset is None else offset,
        unit[1] if unit else 1.0,
        ", ".join(parts),
        len(transform := tags.get(_TRANSFORM, ())) == 16 and float(transform[5]) > 0.0,
    )


def _number(text: str | None) -> float | None:
    try:
        return float(text) if text else None
    except ValueError:
        return None
