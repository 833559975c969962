"""A grey-level picture -> heights: integers span 0..H metres, floats and signed integers are metres.

Pixels without a height are filled from their surroundings and told: NaN, the number that the caller names,
that a GeoTIFF declares, SRTM's -32768, and numbers that nodata.suspects finds. Numbers whose scale, offset or
unit a GeoTIFF states become metres by these.

Pixel (0, 0) is the corner at -X, -Z; a pixel is a vertex, so the sizes span the first to the last pixel.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from paradize.data import Heightfield, Image
from paradize.errors import SourceError
from paradize.kinds import HEIGHTS, expecting
from paradize.readers import srtm
from paradize.readers.geotiff import Said, said_of
from paradize.readers.image import read_image, require_finite
from paradize.readers.nodata import fill_nodata, suspects

# A number that is no height; or "auto": what the file says and what is found; "none": every number is a
# height.
Nodata: TypeAlias = "float | Literal['auto', 'none']"

MAX_SIDE = srtm.MAX_SIDE
HEIGHT_LIMIT_M = 1e7
MOST_GIVEN_M = 1e6  # what commands and scenes take for the height of white
BAND = 256  # rows
_FEW = 16  # codes that use less than this part of their range are told


def read_heightmap(
    path: Path,
    *,
    size_x_m: float,
    size_z_m: float,
    height_m: float | None,
    base_m: float = 0.0,
    height_scale: float = 1.0,
    nodata: Nodata = "auto",
) -> tuple[Heightfield, list[str]]:
    """The heights in `path`, metres, and warnings.

    height_m: how far white lies above black, for integer pictures; None where the file holds metres. base_m:
    y of black (of 0 in floats). height_scale: what all heights are multiplied by, of metres too. Sizes:
    metres, > 0. Raises SourceError for what is no picture, less than 2 pixels on a side, more than MAX_SIDE,
    coloured, without any height, without height_m where it is needed, infinite or farther than HEIGHT_LIMIT_M
    from 0, with the pixel.
    """
    with expecting(HEIGHTS, path):
        image = read_image(path, color_space="data", finite=False)
    rows, columns, channels = image.values.shape
    if min(rows, columns) < 2 or max(rows, columns) > MAX_SIDE:
        raise SourceError(
            f"is {columns} x {rows} pixels; allowed: 2 to {MAX_SIDE} on each side",
            file=path,
            mend="a pixel is a vertex, so a terrain needs two each way",
        )
    if channels >= 3 and not _is_grey(image):
        raise SourceError("is a colour picture", file=path, mend="save the heights as one grey channel")
    image, warnings = with_heights(image, path, nodata)
    if image.top is None:
        if height_m is not None:
            warnings.append(_unused(image, path, height_m))
        unit_m = height_scale
    elif height_m is None:
        what = f"holds codes of 0 to {image.top}, which say no metres"
        raise SourceError(what, file=path, mend="say how high white stands above black: --height H")
    else:
        warnings += _coarse(image, path, height_m)
        unit_m = height_m * height_scale
    heights = np.empty((rows, columns), np.float32)
    bad = 0
    worst: tuple[int, int, float] | None = None
    for band in _bands(rows):
        part = _levels(image, band) * unit_m + base_m
        wrong = ~(np.abs(part) <= HEIGHT_LIMIT_M)
        if wrong.any():
            row, column = (int(k) for k in np.argwhere(wrong)[0])
            worst = worst or (band.start + row, column, float(part[row, column]))
            bad += int(wrong.sum())
        with np.errstate(over="ignore"):  # what overflows is told below
            heights[band] = part
    if worst is not None:
        row, column, height = worst
        raise SourceError(
            f"holds {height:g} m; allowed: up to {HEIGHT_LIMIT_M:g} m ({bad} such)",
            file=path,
            place=f"pixel ({column}, {row})",
        )
    return Heightfield(heights, size_x_m, size_z_m, metres=image.top is None), warnings


def guessed_source(image: Image) -> tuple[str, str]:
    """What a picture holds where nobody says so, "height" or "color", and why that is thought.

    One channel of more than 8 bits, of floats or of signed integers is heights; all else is colour."""
    channels = image.values.shape[2]
    kind = "numbers as they are" if image.top is None else f"{image.source_bits} bits"
    why = f"{channels} channel{'s' if channels > 1 else ''} of {kind}"
    return ("height" if channels == 1 and (image.top is None or image.source_bits > 8) else "color"), why


def with_heights(image: Image, path: Path, nodata: Nodata) -> tuple[Image, list[str]]:
    """The picture that was read of `path` as heights without holes, and warnings.

    It is the same where nothing is to be filled and no GeoTIFF says what its numbers mean; else it has one
    channel of floats: metres (`top` None), or shares of white. Raises SourceError for infinity, for a picture
    without any height, and for a no data value of a coloured one.
    """
    warnings = [f"{path}: the alpha channel is ignored"] if image.values.shape[2] in (2, 4) else []
    if not _is_grey(image):
        if nodata not in ("auto", "none"):
            mend = "leave the no data value out, or save the heights as one grey channel"
            raise SourceError("is a colour picture; its numbers are no heights", file=path, mend=mend)
        require_finite(image.values, path)
        return image, warnings
    said = Said(nodata=srtm.VOID) if path.suffix.lower() == ".hgt" else said_of(path)
    holes, told = _holes(image, said, path, nodata)
    filled, counted = _filled(image, holes, path)
    warnings += counted + told
    if not said.words or (image.top is None and (said.scale, said.offset, said.unit_m) == (1.0, 0.0, 1.0)):
        return filled, warnings
    numbers = _levels(filled, slice(None)) * float(image.top or 1)
    metres = ((numbers * said.scale + said.offset) * said.unit_m).astype(np.float32)
    warnings.append(f"{path}: heights are metres by what the file says of its numbers ({said.words})")
    return replace(filled, values=metres[:, :, None], top=None), warnings


def _is_grey(image: Image) -> bool:
    first = image.values[:, :, 0]
    return image.values.shape[2] < 3 or all(np.array_equal(first, image.values[:, :, k]) for k in (1, 2))


def _bands(rows: int) -> list[slice]:
    """Rows in bands, so that large fields are widened a piece at a time."""
    return [slice(first, min(first + BAND, rows)) for first in range(0, rows, BAND)]


def _levels(image: Image, band: slice) -> npt.NDArray[np.float64]:
    """The first channel of some rows, codes as shares of the largest."""
    return replace(image, values=image.values[band, :, :1]).pixels[:, :, 0].astype(np.float64)


def _native(image: Image, number: float) -> Any:
    """A number of the file as the picture's values hold it; None where they cannot."""
    if image.top is not None and not (0 <= number <= image.top and number == int(number)):
        return None
    with np.errstate(over="ignore"):  # beyond float32 both are infinite
        share = image.values.dtype == np.float32 and image.top is not None
        return image.values.dtype.type(number / image.top if share and image.top else number)


def _holes(image: Image, said: Said, path: Path, nodata: Nodata) -> tuple[dict[Any, str], list[str]]:
    """The values that are no heights, each with the reason, and what else is to be told of such."""
    holes: dict[Any, str] = {}
    told = []
    values, top = image.values[:, :, 0], image.top
    if not isinstance(nodata, str):
        native = _native(image, nodata)
        if native is None or not any((values[band] == native).any() for band in _bands(len(values))):
            told.append(f"{path}: no pixel holds {nodata:.10g}, the no data value that was named")
        else:
            holes[native] = f"{nodata:.10g}, as named"
    if nodata != "none" and said.nodata is not None and (native := _native(image, said.nodata)) is not None:
        holes.setdefault(native, f"{said.nodata:.10g}, as the file says")
    if nodata == "auto" and image.source_bits > 8:
        sure, maybe = suspects(values, list(holes), metres=top is None)
        for number in sure:
            holes[values.dtype.type(number)] = f'{number:.10g}, far from all others; nodata "none" keeps them'
        if maybe is not None:
            number = maybe * (top or 1) if values.dtype == np.float32 else maybe
            told.append(
                f"{path}: {number:.10g} stands apart from all other heights; if it means no data, say so "
                f"(--nodata {number:.10g})"
            )
    return holes, told


def _filled(image: Image, holes: dict[Any, str], path: Path) -> tuple[Image, list[str]]:
    """The picture with a number in every pixel, and how many were filled, for each kind of hole."""
    values = image.values[:, :, 0]
    kinds: list[tuple[str, Any]] = [(why, partial(np.equal, number)) for number, why in holes.items()]
    if values.dtype.kind == "f":
        kinds.append(("NaN", np.isnan))
    missing = np.zeros(values.shape, np.bool_)
    told = []
    for why, is_hole in kinds:
        count, place = _marked(values, is_hole, missing)
        if count:
            how = f"without a height ({why}) are filled from their surroundings"
            told.append(f"{path}: {count} pixels {how}, the first at pixel {place}")
    if missing.all():
        raise SourceError("has no height in any pixel", file=path)
    if values.dtype.kind == "f":
        count, place = _marked(values, np.isinf, np.zeros(values.shape, np.bool_), missing)
        if count:
            raise SourceError("holds infinity", file=path, place=f"pixel {place}")
    if not told:
        return image, []
    filled = fill_nodata(_levels(image, slice(None)), ~missing).astype(np.float32)
    return replace(image, values=filled[:, :, None]), told


def _marked(
    values: npt.NDArray[Any],
    is_hole: Any,
    marks: npt.NDArray[np.bool_],
    but: npt.NDArray[np.bool_] | None = None,
) -> tuple[int, tuple[int, int] | None]:
    """Marks the pixels that are such, but some; how many, and the first as (column, row)."""
    count, place = 0, None
    for band in _bands(len(values)):
        found = is_hole(values[band])
        if but is not None:
            found &= ~but[band]
        if number := int(np.count_nonzero(found)):
            count += number
            marks[band] |= found
            if place is None:
                row, column = (int(k) for k in np.argwhere(found)[0])
                place = column, band.start + row
    return count, place


def _unused(image: Image, path: Path, height_m: float) -> str:
    values = image.values[:, :, 0]
    span = f"{float(values.min()):g} to {float(values.max()):g}"
    return (
        f"{path}: the height given, {height_m:g} m, stretches nothing: floats and signed integers are "
        f"metres already (here {span}); to stretch them, give a scale (--scale F; in a scene height_scale)"
    )


def _coarse(image: Image, path: Path, height_m: float) -> list[str]:
    """What codes cannot say, or do not."""
    assert image.top is not None
    if image.source_bits == 8:
        step = abs(height_m) / image.top
        return [f"{path}: has 8 bits a pixel: heights are steps of {step:.3g} m; save it with 16 bits"]
    most = round(float(image.values[:, :, 0].max()) * (image.top if image.values.dtype == np.float32 else 1))
    if not 0 < most * _FEW < image.top:
        return []
    metres = f"give {image.top} m" if image.top <= MOST_GIVEN_M else "save them as floats"
    return [
        f"{path}: the largest code is {most} of {image.top}, so that heights end at "
        f"{height_m * most / image.top:.3g} of {height_m:g} m; if codes are metres, {metres}"
    ]
