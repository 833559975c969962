"""Measures how visible the switch from one level of a mesh to the next is: FLIP between pictures of both in
light, with their colours and the light that they give off, over the mesh's box.

Pictures are of one lamp and a sky, over a plain background, without gloss, shadow and fog. How much a switch
changes depends on a scene's light, so the limit leaves room (`ROOM`). The kernel is not imported by any stage
(`reference/switch.hpp`); its FLIP is held to the authors' library by a test.
"""

from __future__ import annotations

import numpy as np

from paradize.kernels.reference.seen import SeenLight, SeenMesh, switch_flips
from paradize.metrics.seen import diagonal_of, directions

# Of the bar for a player's pictures, what these may change. Measured in tests/bench/README.md.
ROOM = 0.8
_LIGHT = SeenLight((0.48, 0.8, 0.36), 1.0, 0.5)
_BACKGROUND = 60  # darker than most surfaces, so that silhouettes count
_SAMPLES = 2  # along a pixel, as in the player (4 in a pixel): with more, small pictures are too smooth
# Along the diagonal, of what is drawn. In smaller pictures chance decides: what changes too much at the
# smallest is not taken at a smaller size either. In larger ones FLIP hardly grows.
_SMALLEST_PX, _LARGEST_PX = 24.0, 400.0
_PIXELS = 5 * 128.0**2  # of all directions together, about
_LEAST_DIRECTIONS = 3


def drawn_size(size_px: float) -> float:
    """The size of the pictures that switch_flip draws for a size: equal ones have an equal result."""
    return min(max(size_px, _SMALLEST_PX), _LARGEST_PX)


def switch_flip(before: SeenMesh, after: SeenMesh, size_px: float) -> float:
    """The mean FLIP, 0..1, over the pixels of the projected bounding box of `before`, which has `size_px`
    pixels along its diagonal (at least 24 and at most 400); the mean of directions all around."""
    size = diagonal_of(before)
    if not size > 0:
        return 0.0
    size_px = drawn_size(size_px)
    every = directions()
    count = int(np.clip(_PIXELS / (size_px * size_px), _LEAST_DIRECTIONS, len(every)))
    chosen = every[[int((k + 0.5) * len(every) / count) for k in range(count)]]
    found = switch_flips(
        before, after, chosen, size / size_px, _LIGHT, samples=_SAMPLES, background=_BACKGROUND
    )
    return float(found.sum() / count)
