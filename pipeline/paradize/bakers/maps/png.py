"""The maps of one picture as PNG files: level 0 alone, unsigned codes as glTF reads them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from paradize.bakers.maps.rows import MapRows, encoding_errors, filter_errors, open_angles
from paradize.bakers.product import MapProduct, flat_errors
from paradize.data import Texture
from paradize.formats.png import encode_png
from paradize.map_table import MAPS
from paradize.metrics.levels import gloss_levels, value_levels, vector_error
from paradize.stages.compress import unorm
from paradize.stages.sweep import bands_of, level_count, run, sweep

if TYPE_CHECKING:
    from paradize.stages.sweep import Bundle

F32 = npt.NDArray[np.float32]
Codes = npt.NDArray[Any]


def png_maps(rows: MapRows, *, tier: str, warnings: Sequence[str], measure: bool) -> dict[str, MapProduct]:
    """The maps that `rows` was made for. measure: False leaves out errors."""
    made = {}
    for name in rows.names:
        codes = _codes(name, rows)
        height, width, kind = *codes.shape[:2], "PNG16" if codes.dtype == np.uint16 else "PNG8"
        data, shown = encode_png(codes), _read(name, codes) if measure else None
        del codes  # before errors are measured, which takes room of its own
        level = None if shown is None else _measured(name, rows, shown)
        errors = {} if level is None else flat_errors(name, level)
        if shown is not None and name == "normal":
            errors |= filter_errors(rows.height_map) | open_angles(rows.height_map)
            errors |= encoding_errors(shown, rows.height_map)
        del shown
        metric = next(iter(errors), None)
        made[name] = MapProduct(
            data=data,
            width=width,
            height=height,
            format=kind,
            error=errors[metric] if metric else 0.0,
            metric=metric,
            tier=tier,
            errors=errors,
            warnings=list(warnings),
            levels=[] if level is None else [level],
            filter=None if name == "height" else rows.height_map.filter_name,
        )
    return made


def _codes(name: str, rows: MapRows) -> Codes:
    """The picture's codes: of one channel (h, w, 1) 16 bits, all else (h, w, 3) 8 bits."""
    height, width = rows.height_map.heights.shape
    kind, channels = MAPS[name].kind, MAPS[name].channels
    codes: Codes = np.zeros(
        (height, width, 1 if channels == 1 else 3), np.uint16 if channels == 1 else np.uint8
    )
    top = int(np.iinfo(codes.dtype).max)
    mean = _mean(rows) if kind == "offset" else np.zeros(2)

    def work(band: tuple[int, int]) -> None:
        first, last = band
        if kind == "value":
            codes[first:last, :, :channels] = unorm(rows.rows(name, first, last), top)
        elif kind == "normal":
            codes[first:last] = signed_codes(rows.rows("normal", first, last))
        else:
            xy = rows.rows("normal", first, last)[:, :, :2] - mean
            codes[first:last] = signed_codes(np.dstack([xy, np.zeros((last - first, width))]))

    run(work, bands_of(height, width))
    return codes


def _mean(rows: MapRows) -> npt.NDArray[np.float64]:
    """Mean of the normals' x and y."""
    height, width = rows.height_map.heights.shape
    top = np.zeros(2)

    def visit(level: int, first: int, bundle: Bundle) -> None:
        if level == level_count(height, width) - 1:
            top[:] = bundle["normal"][0, 0, :2]

    sweep(height, width, lambda first, last: rows.bundle(("normal",), first, last), visit)
    return top


def signed_codes(values: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """-1..1 -> 0..255 so that 2v / 255 - 1 is nearest, and zero is 128 (read as 0, as 127 is)."""
    wide: npt.NDArray[np.float64] = np.clip(values, -1.0, 1.0).astype(np.float64)
    return ((wide + 1.0) * 127.5 + 0.5).astype(np.uint8)


def _read(name: str, codes: Codes) -> Texture | F32:
    """Values as a texture of the same codes; of normals and du/dv what glTF's 2v / 255 - 1 reads of
    x and y (h, w, 2), with 127 and 128 both exactly 0."""
    channels = MAPS[name].channels
    if MAPS[name].kind == "value":
        fmt = {1: "R16_UNORM", 2: "RG8_UNORM"}[channels]
        return Texture(fmt, codes.shape[1], codes.shape[0], (codes[:, :, :channels].tobytes(),))
    table = np.arange(256, dtype=np.float32) * np.float32(2.0 / 255.0) - np.float32(1)
    table[127:129] = 0
    values = np.empty((*codes.shape[:2], 2), np.float32)
    for first, last in bands_of(*codes.shape[:2]):
        values[first:last] = table[codes[first:last, :, :2]]
    return values


def _measured(name: str, rows: MapRows, shown: Texture | F32) -> dict[str, float]:
    """The errors of the picture, under the names of a texture's level 0."""
    if isinstance(shown, Texture):
        if name == "gloss":
            return gloss_levels(shown, rows.truth(name), rows.height_map)[0]
        return value_levels(shown, rows.truth(name))[0]
    return vector_error(shown, rows.height_map, less_mean=MAPS[name].kind == "offset")
