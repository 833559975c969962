"""What a viewer sees of the switch from one level of a mesh to the next: FLIP between pictures of both in
light, with their colours and the light that they give off.

Pictures are of one lamp and a sky, over a plain background, without gloss, shadow and fog. How much a switch
changes depends on a scene's light, so the limit leaves room (`ROOM`).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.kernels.reference.seen import SeenLight, SeenMesh, lit_pictures
from paradize.metrics.picture import flip
from paradize.metrics.seen import diagonal_of, directions

# Of the bar for a player's pictures, what these may change. Measured in tests/bench/README.md.
ROOM = 0.65
_LIGHT = SeenLight((0.48, 0.8, 0.36), 0.75, 0.25)
_BACKGROUND = 115 / 255  # sRGB: neither as dark nor as bright as most surfaces
_SAMPLES = (
    2  # along the side of a pixel, as in the player (4 in a pixel): with more, small pictures are too smooth
)
_MARGIN = 12  # pixels: as far as FLIP's filters reach
_LARGEST_PX = 512.0  # along the diagonal: larger pictures are not drawn
_PIXELS = 14 * 96.0**2  # of all directions together, about; at least three directions
_LEAST_DIRECTIONS = 3


def switch_flip(before: SeenMesh, after: SeenMesh, size_px: float) -> float:
    """The mean FLIP, 0..1, over the projected bounding box of `before`, which has `size_px` pixels along its
    diagonal; the mean of directions all around."""
    size = diagonal_of(before)
    if not size > 0:
        return 0.0
    size_px = min(size_px, _LARGEST_PX)
    count = int(np.clip(_PIXELS / (size_px * size_px), _LEAST_DIRECTIONS, len(directions())))
    step = len(directions()) / count
    chosen = [directions()[int((k + 0.5) * step)] for k in range(count)]
    pictures, boxes = [], []
    for toward in chosen:
        pixel = size / size_px
        pair = lit_pictures(before, after, toward, pixel, _LIGHT, samples=_SAMPLES, margin=_MARGIN)
        pictures.append([_encoded(one) for one in pair])
        boxes.append(_box_px(before, toward, pixel))
    sums = _sums_of_flip(pictures)
    return float(np.mean([min(1.0, error / box) for error, box in zip(sums, boxes, strict=True)]))


def _sums_of_flip(pairs: list[list[npt.NDArray[np.float32]]]) -> list[float]:
    """FLIP's sum over each pair of pictures. They are compared beside each other in one picture, because a
    call of the library costs as much as a hundred thousand pixels; their margins keep its filters apart."""
    height, width = (max(one[0].shape[axis] for one in pairs) for axis in (0, 1))
    both = np.full((2, height * len(pairs), width, 3), _BACKGROUND, np.float32)
    for k, pair in enumerate(pairs):
        for side, picture in enumerate(pair):
            both[side, k * height : k * height + picture.shape[0], : picture.shape[1]] = picture
    errors = flip(both[0], both[1])
    return [float(part.sum(dtype=np.float64)) for part in np.split(errors, len(pairs))]


def _box_px(mesh: SeenMesh, toward: npt.NDArray[np.float64], pixel: float) -> float:
    """The pixels of the rectangle around the mesh's bounding box in a picture."""
    corners = mesh.positions[mesh.triangles.reshape(-1)]
    sides = (corners.max(axis=0).astype(np.float64) - corners.min(axis=0)) / pixel
    pole = np.array([0.0, 1.0, 0.0] if abs(toward[1]) < 0.9 else [0.0, 0.0, 1.0])
    right = np.cross(pole, toward)
    right /= np.sqrt((right * right).sum())
    width, height = (
        max(1.0, float((np.abs(axis) * sides).sum())) for axis in (right, np.cross(toward, right))
    )
    return width * height


def _encoded(lit: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """A picture over the background, (h, w, 3) sRGB, 0..1, in steps of 8 bits as a screen shows it."""
    background = ((_BACKGROUND + 0.055) / 1.055) ** 2.4
    x = np.clip(lit[:, :, :3] + (1.0 - lit[:, :, 3:]) * background, 0.0, 1.0)
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1.0 / 2.4) - 0.055)
    return np.asarray(np.rint(255.0 * np.clip(encoded, 0.0, 1.0)) / 255.0, np.float32)
