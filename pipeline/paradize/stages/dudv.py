"""Du/dv maps: the signed x and y of a normal map minus their mean, so that reflections do not drift."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.kernels import maps

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]


class DudvLevels:
    """Collects the codes of every level of a du/dv map, band by band. The codes of a level sum to exactly
    zero.

    mean: of x and y over the map, from the last level of the averaged normals.
    """

    def __init__(self, height: int, width: int, count: int, mean: tuple[float, float]) -> None:
        self._mean = mean
        shapes = [(max(1, height >> k), max(1, width >> k), 2) for k in range(count)]
        self._codes = [np.empty(shape, np.int8) for shape in shapes]
        self._rest = [np.empty(shape, np.int8) for shape in shapes]

    def put(self, level: int, first: int, means: F32) -> None:
        """Rows (n, w, 3) of a level's means of unit normals, from its row `first` on."""
        last = first + len(means)
        codes, rest = maps.dudv_codes(means, self._mean, threads=1)
        self._codes[level][first:last], self._rest[level][first:last] = codes, rest

    def levels(self) -> list[bytes]:
        """Returns the SNORM codes of every level, finest first, and frees the memory."""
        done = []
        while self._codes:
            codes, rest = self._codes.pop(0), self._rest.pop(0)
            maps.balance(codes, rest)
            del rest
            done.append(codes.tobytes())
        return done
