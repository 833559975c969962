"""The maps of one picture as PNG files: level 0 alone, unsigned codes as glTF reads them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from paradize.bake_map_rows import MapRows
from paradize.bake_product import MapProduct, six
from paradize.formats.png import encode_png
from paradize.metrics.angle import normal_error
from paradize.metrics.levels import filter_error
from paradize.metrics.psnr import psnr_db
from paradize.stages.compress import unorm
from paradize.stages.sweep import bands_of, level_count, run, sweep

if TYPE_CHECKING:
    from paradize.stages.sweep import Bundle

F32 = npt.NDArray[np.float32]
Codes = npt.NDArray[Any]


def png_maps(
    rows: MapRows,
    *,
    tier: str,
    warnings: Sequence[str],
    budget: Mapping[str, float],
    zstd: int | None,
    measure: bool,
) -> dict[str, MapProduct]:
    """The maps that `rows` was made for; PNG knows neither another format for a budget nor zstd."""
    del budget, zstd
    made = {}
    for name in rows.names:
        codes = _codes(name, rows)
        errors = (
            {metric: six(value) for metric, value in _errors(name, rows, codes).items()} if measure else {}
        )
        metric = next(iter(errors), None)
        made[name] = MapProduct(
            encode_png(codes),
            codes.shape[1],
            codes.shape[0],
            "PNG16" if codes.dtype == np.uint16 else "PNG8",
            errors[metric] if metric else 0.0,
            metric,
            tier,
            errors,
            list(warnings),
            filter=None if name == "height" else rows.ground.filter_name,
        )
    return made


def _codes(name: str, rows: MapRows) -> Codes:
    """The picture's codes: height (h, w, 1) 16 bits, all else (h, w, 3) 8 bits."""
    height, width = rows.ground.heights.shape
    codes: Codes = np.zeros(
        (height, width, 1 if name == "height" else 3), np.uint16 if name == "height" else np.uint8
    )
    mean = _mean(rows) if name == "dudv" else np.zeros(2)

    def work(band: tuple[int, int]) -> None:
        first, last = band
        if name == "height":
            codes[first:last] = unorm(rows.rows("height", first, last), 65535)
        elif name == "gloss":
            codes[first:last, :, :2] = unorm(rows.rows("gloss", first, last), 255)
        elif name == "normal":
            codes[first:last] = signed_codes(rows.rows("normal", first, last))
        else:
            xy = rows.rows("normal", first, last)[:, :, :2] - mean
            codes[first:last] = signed_codes(np.dstack([xy, np.zeros((last - first, width))]))

    run(work, bands_of(height, width))
    return codes


def _mean(rows: MapRows) -> npt.NDArray[np.float64]:
    """Mean of the normals' x and y."""
    height, width = rows.ground.heights.shape
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


def _read_signed(codes: Codes) -> F32:
    """What glTF's 2v / 255 - 1 reads, with 127 and 128 both exactly 0."""
    values = codes.astype(np.float32) * np.float32(2.0 / 255.0) - np.float32(1)
    return np.where((codes == 127) | (codes == 128), np.float32(0), values)


def _errors(name: str, rows: MapRows, codes: Codes) -> dict[str, float]:
    ground = rows.ground
    if name == "height":
        return {"height_psnr_db": psnr_db(codes / 65535.0, rows.whole("height"))}
    if name == "gloss":
        return {"gloss_psnr_db": psnr_db(codes[:, :, :2] / 255.0, rows.whole("gloss"))}
    found = normal_error(
        _read_signed(codes[:, :, :2]), ground.heights, **ground.settings, less_mean=name == "dudv"
    )
    errors = {f"{name}_p99_deg": found.p99, f"{name}_mean_deg": found.mean, f"{name}_max_deg": found.max}
    if name == "normal":
        errors["normal_filter_deg"] = filter_error(
            ground.heights, slope_scale=ground.slopes, wrap=ground.wrap, filter_name=ground.filter_name
        )["mean_deg"]
    return errors
