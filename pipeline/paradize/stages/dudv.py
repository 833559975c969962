"""Du/dv: the signed x and y of a normal map, less their mean, so that what they shake does not drift."""

from __future__ import annotations

from typing import TYPE_CHECKING

from paradize.kernels import maps

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


def dudv_map(normals: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Du/dv (h, w, 2) float32 of unit normals (h, w, 3); its mean over the map is zero to float precision."""
    return maps.centred_xy(normals)
