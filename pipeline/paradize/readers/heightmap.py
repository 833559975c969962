"""Reads a picture as heights: unsigned integers span 0..H metres; floats, signed integers and tiles of web
maps are metres.

Pixels without a height are filled from their surroundings, with a warning: NaN, the number that the caller
names or a file declares (GeoTIFF, ESRI ASCII grid), SRTM's -32768, and numbers that nodata.suspects finds. If
a GeoTIFF states scale, offset or unit, its numbers are converted to metres.

A pixel is a vertex; pixel (0, 0) is the corner at -X, -Z. Sizes span the first to the last pixel.
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
from paradize.readers.geotiff import GeoTiffTags, read_geotiff_tags
from paradize.readers.grids import MAX_SIDE
from paradize.readers.height_tile import metres_of_tile, tile_step_m, tile_warnings
from paradize.readers.image import read_image, require_finite
from paradize.readers.nodata import fill_nodata, finite_range, suspects
from paradize.readers.notes import FIRST_BAND
from paradize.vectors import dot

# The number that means "no height". "auto": declared by the file or detected. "none": there is none.
Nodata: TypeAlias = "float | Literal['auto', 'none']"

HEIGHT_LIMIT_M = 1e7
MAX_WHITE_M = 1e6  # largest height of white that commands and scenes accept
BAND = 256  # rows
_MOST_TINT = 0.025  # of a grey picture: programs round its three colours each by itself
_COLORED = 0.25  # the tint of colours; blocks of BC1 make up to 0.2,
_UNSEEN = 16 / 255  # and where all is flat a large tint of next to no difference, of all that a number may be
_BT709 = np.array([0.2126, 0.7152, 0.0722])
GIVE_HEIGHTS = "give the picture that holds the heights"
_LOW_RANGE = 16  # warns where integers use less than 1/16 of their range


@np.errstate(invalid="ignore")  # a file may hold signalling NaN
def read_heightmap(
    path: Path,
    *,
    size_x_m: float,
    size_z_m: float,
    height_m: float | None,
    base_m: float = 0.0,
    height_scale: float = 1.0,
    nodata: Nodata = "auto",
    encoding: str = "grey",
) -> tuple[Heightfield, list[str]]:
    """Reads the heights of a picture in metres. Returns them with warnings.

    size_x_m, size_z_m: metres, > 0. height_m: height of white above black for unsigned integers; None where
    the file holds metres. base_m: y of black (of 0 for floats). height_scale: factor of all heights, also of
    metres. nodata: see Nodata. encoding: "grey", or "terrarium" or "terrain-rgb" of a tile (height_tile.py).

    Raises SourceError, with the pixel where there is one, for a file that is not a picture, has fewer than 2
    or more than MAX_SIDE pixels on a side, is coloured, has no height at all, needs height_m, or holds
    infinity or a height beyond +-HEIGHT_LIMIT_M.
    """
    with expecting(HEIGHTS, path):
        image = _first_band(read_image(path, color_space="data", finite=False))
    rows, columns, _ = image.values.shape
    if min(rows, columns) < 2 or max(rows, columns) > MAX_SIDE:
        small = "a pixel is a vertex, so a terrain needs two each way"
        raise SourceError(
            f"is {columns} x {rows} pixels; allowed: 2 to {MAX_SIDE} on each side",
            file=path,
            mend=small if min(rows, columns) < 2 else "make it smaller, or cut it into several terrains",
        )
    if encoding != "grey":
        image = metres_of_tile(image, path, encoding)
    elif _tint(image) > _MOST_TINT:
        which = "(--encoding terrarium or terrain-rgb; in a scene encoding)"
        tile = f"of a map's tile, whose colours are digits, say which {which}"
        raise SourceError(
            "is a colour picture", file=path, mend=f"save the heights as one grey channel; {tile}"
        )
    if image.top is not None and height_m is None and not read_geotiff_tags(path).words:
        what = f"holds integers of 0 to {image.top}, not metres"
        raise SourceError(what, file=path, mend="say how high white stands above black: --height H")
    image, warnings = with_heights(image, path, nodata)
    if image.top is None:
        if height_m is not None:
            warnings.append(_unused_height(image, path, height_m))
        unit_m = height_scale
        step_m = 0.0 if encoding == "grey" else tile_step_m(encoding) * abs(height_scale)
        warnings += [] if encoding == "grey" else tile_warnings(image, path, encoding)
    else:
        assert height_m is not None
        unit_m = height_m * height_scale
        step_m = abs(unit_m) / image.top
        warnings += _precision_warnings(image, path, height_m, step_m)
    heights = np.empty((rows, columns), np.float32)
    bad = 0
    worst: tuple[int, int, float] | None = None
    for band in _bands(rows):
        part = _as_shares(image, band) * unit_m + base_m
        wrong = ~(np.abs(part) <= HEIGHT_LIMIT_M)
        if wrong.any():
            row, column = (int(k) for k in np.argwhere(wrong)[0])
            worst = worst or (band.start + row, column, float(part[row, column]))
            bad += int(wrong.sum())
        with np.errstate(over="ignore"):  # overflow is reported below
            heights[band] = part
    if worst is not None:
        row, column, height = worst
        raise SourceError(
            f"holds {height:g} m; allowed: up to {HEIGHT_LIMIT_M:g} m ({bad} such)",
            file=path,
            place=f"pixel ({column}, {row})",
            mend="save the heights in metres, or scale them less",
        )
    if (low := float(heights.min())) == float(heights.max()):
        warnings.append(f"{path}: every height is {low:g} m, so the ground is flat; {GIVE_HEIGHTS}")
    return Heightfield(heights, size_x_m, size_z_m, step_m), warnings


def guess_source(image: Image) -> tuple[str, str]:
    """Guesses what a picture holds, "height" or "color", and returns the reason as text.

    One channel of more than 8 bits, of floats or of signed integers is heights; everything else is colour.
    """
    channels = image.values.shape[2]
    kind = "numbers as they are" if image.top is None else f"{image.source_bits} bits"
    why = f"{channels} channel{'s' if channels > 1 else ''} of {kind}"
    return ("height" if channels == 1 and (image.top is None or image.source_bits > 8) else "color"), why


@np.errstate(invalid="ignore", over="ignore")  # a file may hold signalling NaN, and any scale
def with_heights(image: Image, path: Path, nodata: Nodata) -> tuple[Image, list[str]]:
    """Returns a picture as heights without holes, and warnings.

    The picture is unchanged where there are no holes and no GeoTIFF tags. Otherwise it has one float channel:
    metres (`top` None) or shares of white. Raises SourceError for infinity, for a picture without any height,
    and for a no-data value with a coloured picture.
    """
    image = _first_band(image)
    warnings = [f"{path}: {note}" for note in image.notes]
    warnings += [f"{path}: the alpha channel is ignored"] if image.values.shape[2] in (2, 4) else []
    tint = _tint(image)
    if tint > _MOST_TINT:
        if nodata not in ("auto", "none"):
            mend = "leave the no data value out, or save the heights as one grey channel"
            raise SourceError("is a colour picture; its numbers are not heights", file=path, mend=mend)
        require_finite(image.values, path)
        return image, warnings + color_warnings(image, path, "heights")
    if tint > 0.0:
        what = (
            f"is not quite grey (its colours differ by up to {tint:.2g} of their range); their mean is read"
        )
        warnings.append(f"{path}: {what}")
        image = _mean(image)
    tags = read_geotiff_tags(path) if image.nodata is None else GeoTiffTags(nodata=image.nodata)
    if tags.south_up:
        warnings.append(f"{path}: its first row is the south, and lies at -Z as any first row: turn it over")
    holes, hole_warnings = _holes(image, tags, path, nodata)
    filled, fill_warnings = _fill(image, holes, path)
    warnings += fill_warnings + hole_warnings
    if not tags.words or (image.top is None and (tags.scale, tags.offset, tags.unit_m) == (1.0, 0.0, 1.0)):
        return filled, warnings
    numbers = _as_shares(filled, slice(None)) * float(image.top or 1)
    metres = ((numbers * tags.scale + tags.offset) * tags.unit_m).astype(np.float32)
    what = f"heights are converted to metres as the file says ({tags.words})"
    if not np.isfinite(metres).all():
        raise SourceError(f"{what}, and are not finite then", file=path, mend="save the heights again")
    warnings.append(f"{path}: {what}")
    return replace(filled, values=metres[:, :, None], top=None), warnings


def _first_band(image: Image) -> Image:
    """The first of two bands of numbers, which read_image returns as red and green; others as they are."""
    values = image.values
    if image.top is not None or values.shape[2] != 3 or values[:, :, 2].any() or not values[:, :, 1].any():
        return image
    first: Any = np.ascontiguousarray(values[:, :, :1])
    return replace(image, values=first, notes=(*image.notes, FIRST_BAND))


def color_warnings(image: Image, path: Path, read_as: str) -> list[str]:
    """A warning where a picture of numbers has colours: it holds normals, or several maps."""
    apart, span = _colors_apart(image)
    if apart <= max(_COLORED * span, _UNSEEN * (image.top or 1.0)):
        return []
    mend = "give a grey picture, not normals or several maps in one"
    return [f"{path}: is coloured; its luminance is read as {read_as}: {mend}"]


def _colors_apart(image: Image) -> tuple[float, float]:
    """The largest difference of its colours, 0 of a grey picture, and the range of red."""
    values, most = image.values, 0.0
    if values.shape[2] < 3:
        return 0.0, 0.0
    low, high = finite_range(values[:, :, 0], ()) or (0.0, 0.0)
    for band in _bands(len(values)):
        with np.errstate(invalid="ignore"):  # infinite heights are told later
            steps = np.abs(values[band, :, 1:3] - values[band, :, :1].astype(np.float64))
        most = max(most, float(np.max(steps, where=np.isfinite(steps), initial=0.0)))
    return most, float(high) - float(low)


def _tint(image: Image) -> float:
    """The largest difference of its colours, as a share of the range of red; 0 of a grey picture."""
    apart, span = _colors_apart(image)
    return apart / span if span > 0.0 else float(apart > 0.0)


def _mean(image: Image) -> Image:
    """The BT.709 mean of its colours as one channel of the same type."""
    values = image.values
    grey = np.empty((*values.shape[:2], 1), values.dtype)
    for band in _bands(len(values)):
        mean = dot(values[band].astype(np.float64), _BT709)
        grey[band, :, 0] = mean if values.dtype == np.float32 else np.rint(mean)
    return replace(image, values=grey)


def _bands(rows: int) -> list[slice]:
    """Row ranges, so that large fields are converted to float64 in parts."""
    return [slice(first, min(first + BAND, rows)) for first in range(0, rows, BAND)]


def _as_shares(image: Image, band: slice) -> npt.NDArray[np.float64]:
    """The first channel of some rows as float64; integers as shares of the largest."""
    return replace(image, values=image.values[band, :, :1]).pixels[:, :, 0].astype(np.float64)


def _as_file_type(image: Image, number: float) -> Any:
    """A number of the file in the type of the picture's values; None where that type cannot hold it."""
    if image.top is not None and not (0 <= number <= image.top and number == int(number)):
        return None
    with np.errstate(over="ignore"):  # beyond float32 both become infinite
        share = image.values.dtype == np.float32 and image.top is not None
        return image.values.dtype.type(number / image.top if share and image.top else number)


def _holes(image: Image, tags: GeoTiffTags, path: Path, nodata: Nodata) -> tuple[dict[Any, str], list[str]]:
    """The values that are not heights, each with the reason, and warnings."""
    holes: dict[Any, str] = {}
    warnings = []
    values, top = image.values[:, :, 0], image.top
    if not isinstance(nodata, str):
        number = _as_file_type(image, nodata)
        if number is None or not any((values[band] == number).any() for band in _bands(len(values))):
            warnings.append(f"{path}: no pixel holds {nodata:.10g}, the given no-data value")
        else:
            holes[number] = f"{nodata:.10g}, as given"
    if (
        nodata != "none"
        and tags.nodata is not None
        and (number := _as_file_type(image, tags.nodata)) is not None
    ):
        holes.setdefault(number, f"{tags.nodata:.10g}, as the file says")
    if nodata == "auto" and image.source_bits > 8:
        sure, maybe = suspects(values, list(holes), metres=top is None)
        for value in sure:
            holes[values.dtype.type(value)] = f'{value:.10g}, far from all others; nodata "none" keeps them'
        if maybe is not None:
            value = maybe * (top or 1) if values.dtype == np.float32 else maybe
            warnings.append(
                f"{path}: {value:.10g} lies far from all other heights; if it means no data, say so "
                f"(--nodata {value:.10g})"
            )
    return holes, warnings


def _fill(image: Image, holes: dict[Any, str], path: Path) -> tuple[Image, list[str]]:
    """Returns the picture without holes, and a warning with the number of filled pixels for each kind of
    hole."""
    values = image.values[:, :, 0]
    kinds: list[tuple[str, Any]] = [(why, partial(np.equal, number)) for number, why in holes.items()]
    if values.dtype.kind == "f":
        kinds.append(("NaN", np.isnan))
    missing = np.zeros(values.shape, np.bool_)
    warnings, found = [], []
    for why, is_hole in kinds:
        count, place = _mark(values, is_hole, missing)
        if count:
            found.append(why.partition(",")[0])
            pixels, how = (
                ("pixels", "are filled from their") if count > 1 else ("pixel", "is filled from its")
            )
            what = f"{count} {pixels} without a height ({why}) {how} surroundings"
            warnings.append(f"{path}: {what}, the first at pixel {place}")
    if missing.all():
        what = f"has no height in any pixel: each is {' or '.join(found)}"
        mend = "save the heights again; if such numbers are heights, nodata none keeps them (--nodata none)"
        raise SourceError(what, file=path, mend=mend)
    if values.dtype.kind == "f":
        count, place = _mark(values, np.isinf, np.zeros(values.shape, np.bool_), missing)
        if count:
            mend = "a height is a finite number; save the heights again"
            raise SourceError("holds infinity", file=path, place=f"pixel {place}", mend=mend)
    if not warnings:
        return image, []
    filled = fill_nodata(_as_shares(image, slice(None)), ~missing).astype(np.float32)
    return replace(image, values=filled[:, :, None]), warnings


def _mark(
    values: npt.NDArray[Any],
    is_hole: Any,
    mask: npt.NDArray[np.bool_],
    excluded: npt.NDArray[np.bool_] | None = None,
) -> tuple[int, tuple[int, int] | None]:
    """Sets mask (h, w) where is_hole and not excluded. Returns the number of such pixels and the first as
    (column, row)."""
    count, place = 0, None
    for band in _bands(len(values)):
        marked = is_hole(values[band])
        if excluded is not None:
            marked &= ~excluded[band]
        if number := int(np.count_nonzero(marked)):
            count += number
            mask[band] |= marked
            if place is None:
                row, column = (int(k) for k in np.argwhere(marked)[0])
                place = column, band.start + row
    return count, place


def _unused_height(image: Image, path: Path, height_m: float) -> str:
    values = image.values[:, :, 0]
    span = f"{float(values.min()):g} to {float(values.max()):g}"
    return (
        f"{path}: the given height, {height_m:g} m, has no effect: floats, signed integers and tiles "
        f"are metres already (here {span}); to stretch them, scale them (--scale F; in a scene height_scale)"
    )


def _precision_warnings(image: Image, path: Path, height_m: float, step_m: float) -> list[str]:
    """Warnings about 8-bit heights and about integers that use a small part of their range."""
    assert image.top is not None
    if image.source_bits == 8:
        return [f"{path}: has 8 bits a pixel: heights are steps of {step_m:.3g} m; save it with 16 bits"]
    largest = round(
        float(image.values[:, :, 0].max()) * (image.top if image.values.dtype == np.float32 else 1)
    )
    if not 0 < largest * _LOW_RANGE < image.top:
        return []
    metres = f"give {image.top} m" if image.top <= MAX_WHITE_M else "save them as floats"
    return [
        f"{path}: the largest integer is {largest} of {image.top}, so heights end at "
        f"{height_m * largest / image.top:.3g} of {height_m:g} m; if the integers are metres, {metres}"
    ]
