"""Passes over a picture in bands of rows. Each band is made, visited and halved while it is in the cache.

A bundle holds several arrays (n, w, c) of the same texels, by name. Bands run in several threads. The result
does not depend on the number of threads, because each band writes only its own rows.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.kernels import maps

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    Bundle = dict[str, npt.NDArray[Any]]
    Source = Callable[[int, int], Bundle]  # rows [first, last) of the finest level
    Visit = Callable[[int, int, Bundle], None]  # level, its row that the bundle begins with, the bundle
    Halve = Callable[[Bundle, int, int, int], Bundle]  # a band, its level, that level's rows, first row above

_DEEP = 3  # levels that a band makes before all bands are joined for the next round
_BAND_TEXELS = 1 << 17  # about 3 MB of normals and what is made of them


def level_count(height: int, width: int) -> int:
    """Returns the number of levels down to 1 x 1."""
    return max(height, width).bit_length()


def halved(bundle: Bundle, level: int, rows: int, first: int) -> Bundle:
    """Area means of every array; see `kernels.maps.halve`."""
    del level
    return {name: maps.halve(array, rows=rows, first=first, threads=1) for name, array in bundle.items()}


def run(work: Callable[[tuple[int, int]], None], bands: list[tuple[int, int]]) -> None:
    """Calls work for every band, in as many threads as kernels use."""
    if maps.THREADS == 1 or len(bands) == 1:
        for band in bands:
            work(band)
        return
    with ThreadPoolExecutor(maps.THREADS) as pool:
        for _ in pool.map(work, bands):
            pass


def bands_of(rows: int, width: int, unit: int = 4) -> list[tuple[int, int]]:
    """Bands [first, last) that cover the rows; each begins at a multiple of `unit`."""
    size = -(-max(1, _BAND_TEXELS // width) // unit) * unit
    return [(first, min(first + size, rows)) for first in range(0, rows, size)]


def sweep(
    height: int,
    width: int,
    source: Source,
    visit: Visit,
    *,
    count: int | None = None,
    halve: Halve = halved,
) -> None:
    """Makes `count` levels of a picture of height x width texels (default: all).

    visit is called once for each band of each level, in no fixed order. Bands begin at multiples of four
    rows, so that they can be compressed into blocks. Raises ValueError for a picture without texels.
    """
    if height < 1 or width < 1:
        raise ValueError(f"no levels of {height} x {width} texels")
    level, left = 0, (level_count(height, width) if count is None else count) - 1
    while True:
        deep = min(_halvings(height), _halvings(width), _DEEP, left)
        if left == 0:
            run(lambda band, s=source, k=level: visit(k, band[0], s(*band)), bands_of(height, width))  # type: ignore[misc]
            return
        gathered: Bundle = {}
        work = _worker(
            height,
            width,
            deep=max(1, deep),
            source=source,
            visit=visit,
            halve=halve,
            level=level,
            gathered=gathered,
        )
        bands = _halved_bands(height, width, max(1, deep))
        work(bands[0])  # first, because it allocates the arrays that all bands write into
        run(work, bands[1:] or [])
        level, left = level + max(1, deep), left - max(1, deep)
        height, width = (max(1, size >> max(1, deep)) for size in (height, width))
        source = _rows_of(gathered)


def _halvings(size: int) -> int:
    """How often a size can be halved without a remainder."""
    return (size & -size).bit_length() - 1


def _rows_of(bundle: Bundle) -> Source:
    return lambda first, last: {name: array[first:last] for name, array in bundle.items()}


def _halved_bands(height: int, width: int, deep: int) -> list[tuple[int, int]]:
    """Returns bands of the level that is `deep` levels coarser. Each has at least four rows on the levels
    before it."""
    unit = max(1, 2 if deep == 1 else 4 << (deep - 1) >> deep)
    rows = max(1, height >> deep)
    size = -(-max(1, (_BAND_TEXELS // width) >> deep) // unit) * unit
    return [(first, min(first + size, rows)) for first in range(0, rows, size)]


def _worker(
    height: int,
    width: int,
    deep: int,
    source: Source,
    visit: Visit,
    halve: Halve,
    level: int,
    gathered: Bundle,
) -> Callable[[tuple[int, int]], None]:
    """Returns a function that visits `deep` levels of a band and stores the next level in `gathered`."""
    end = max(1, height >> deep)

    def work(band: tuple[int, int]) -> None:
        first, last = band
        if deep == 1:
            begin, stop = maps.rows_below(height, first, last)
            bundle = source(begin, stop)
            own = stop if last == end else 2 * last  # an odd size's bands share a row
            visit(level, begin, {name: array[: own - begin] for name, array in bundle.items()})
            bundle = halve(bundle, level, height, first)
        else:
            begin, stop = first << deep, last << deep
            bundle = source(begin, stop)
            for k in range(deep):
                visit(level + k, begin >> k, bundle)
                bundle = halve(bundle, level + k, height >> k, begin >> (k + 1))
        if not gathered:
            for name, array in bundle.items():
                gathered[name] = np.empty((end, *array.shape[1:]), array.dtype)
        for name, array in bundle.items():
            gathered[name][first:last] = array

    return work
