"""Height fields that Hypothesis draws."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

F32 = npt.NDArray[np.float32]


def height_grids(largest: int) -> st.SearchStrategy[F32]:
    """Noise, and plains with a few peaks: 2 to `largest` heights a side, in quarters of a metre."""
    shapes = hnp.array_shapes(min_dims=2, max_dims=2, min_side=2, max_side=largest)
    plains = hnp.arrays(np.int8, shapes, elements=st.integers(-50, 50)).map(
        lambda steps: steps / np.float32(4)
    )
    return shapes.flatmap(_noise) | plains


def _noise(shape: tuple[int, ...]) -> st.SearchStrategy[F32]:
    """Drawn as bytes: one draw for a grid, where one for each height takes longer than the test."""
    drawn = st.binary(min_size=math.prod(shape), max_size=math.prod(shape))
    return drawn.map(lambda text: np.frombuffer(text, np.uint8).reshape(shape) % 101 / np.float32(4) - 12.5)
