"""Our normals of published heights and colours beside the normals that were published with them; and of
heights made by formula beside its own normals.

`python -m tests.pipeline.readers.test_published_pairs FOLDER` prints the table. Nobody tells how strong a
published map was made, by which filter and from which master (all heights here are of 8 bits, two of them
JPEG), so the strength is fitted and the angle says how far two reasonable makers are apart, not an error.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from paradize.readers.image import read_image
from paradize.stages.filters import choose_filter
from paradize.stages.height import height_from_color
from tests.pipeline.heights import angles_between, normals, up
from tests.sweeps import sample

Source = Callable[[str], Path]
BOTH = (True, True)  # all of them are tiles


@dataclass(frozen=True)
class Pair:
    """Files of the corpus, or made; green_down and depth (white is deep) as its manifest measured them.
    in_alpha: the height is the picture's alpha. correlation, mean_deg: what the test asks."""

    name: str
    source: str
    normal: str
    green_down: bool
    depth: bool = False
    in_alpha: bool = False
    from_color: bool = False
    correlation: float = 0.0
    mean_deg: float = 180.0


SAND = "corpus/pbr-pairs/hterrain-sand/sand_"
ROCK = "corpus/pbr-pairs/panda3d-layingrock/layingrock-"
SEASIDE = "corpus/pbr-pairs/playcanvas-seaside-rocks/seaside-rocks01-"
GROUND = "corpus/pbr-pairs/terrain3d/ground037_"
MADE = "made/pbr-pairs/made/"
# Of 8-bit codes: what is missing from 1 and 0 is their rounding.
MADE_PAIRS = [
    Pair("up", MADE + "height.png", MADE + "normal_up.png", False, correlation=0.98, mean_deg=3.0),
    Pair("down", MADE + "height.png", MADE + "normal_down.png", True, correlation=0.98, mean_deg=3.0),
    Pair("deep", MADE + "depth.png", MADE + "normal_up.png", False, depth=True,
         correlation=0.98, mean_deg=3.0),
    Pair("in alpha", MADE + "beside.png", MADE + "normal_down.png", True, in_alpha=True,
         correlation=0.98, mean_deg=3.0),
]  # fmt: skip
# The bounds leave room for another filter of the same quality: what fails them has lost its sign, an axis or
# a texel. The manifest's own correlations, of blurred maps, are 0.98, 0.96, 0.96 and 0.88.
PAIRS = [
    Pair("sand", SAND + "depth.png", SAND + "normal.png", True, correlation=0.95, mean_deg=8.0),
    Pair("laying rock", ROCK + "h.jpg", ROCK + "n.jpg", True, depth=True, correlation=0.9, mean_deg=16.0),
    Pair("seaside rocks", SEASIDE + "height.jpg", SEASIDE + "normal.jpg", True,
         correlation=0.8, mean_deg=5.0),
    Pair("ground037", GROUND + "alb_ht.png", GROUND + "nrm_rgh.png", False, in_alpha=True,
         correlation=0.8, mean_deg=12.0),
    Pair("sand, colour", SAND + "albedo.png", SAND + "normal.png", True, from_color=True),
    Pair("laying rock, colour", ROCK + "c.jpg", ROCK + "n.jpg", True, from_color=True),
    Pair("seaside rocks, colour", SEASIDE + "color.jpg", SEASIDE + "normal.jpg", True, from_color=True),
    Pair("ground037, colour", GROUND + "alb_ht.png", GROUND + "nrm_rgh.png", False, from_color=True),
]  # fmt: skip


@dataclass(frozen=True)
class Result:
    """filter_name: what `auto` took. strength: percent of the width that white stands high. correlations: of
    all slopes, along x, along y. mean_deg, p99_deg: between our normals and the published ones."""

    filter_name: str
    strength: float
    correlation: float
    along_x: float
    along_y: float
    mean_deg: float
    p99_deg: float


def heights_of(pair: Pair, path: Path) -> np.ndarray:
    if pair.from_color:
        return height_from_color(read_image(path))
    pixels = read_image(path, color_space="data").pixels
    plane = np.ascontiguousarray(pixels[:, :, 3 if pair.in_alpha else 0])
    return -plane if pair.depth else plane


def published(pair: Pair, path: Path, shape: tuple[int, int]) -> np.ndarray:
    """The published normals (h, w, 3), unit, green up; a larger map is averaged to the heights' size."""
    vectors = read_image(path, color_space="data").pixels[:, :, :3].astype(np.float64) * 2 - 1
    times = vectors.shape[0] // shape[0]
    if times > 1:
        vectors = vectors.reshape(shape[0], times, shape[1], times, 3).mean(axis=(1, 3))
    if pair.green_down:
        vectors = vectors * [1, -1, 1]
    return np.asarray(vectors / np.linalg.norm(vectors, axis=2, keepdims=True))


def slopes_of(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    z = np.maximum(normals[:, :, 2].astype(np.float64), 0.05)
    return -normals[:, :, 0] / z, normals[:, :, 1] / z


def compare(pair: Pair, source: Source) -> Result:
    heights = heights_of(pair, source(pair.source))
    name = choose_filter(heights, 8, BOTH)
    dx, dy = slopes_of(normals(heights, wrap=BOTH, filter_name=name))
    theirs = published(pair, source(pair.normal), heights.shape)
    tx, ty = slopes_of(theirs)
    least = float(((dx * tx).sum() + (dy * ty).sum()) / ((dx * dx).sum() + (dy * dy).sum()))
    part = (slice(None, None, 4), slice(None, None, 3))
    strength = min(
        (least * factor for factor in np.geomspace(0.5, 2.0, 25)),
        key=lambda k: float(angles_between(up(dx[part] * k, dy[part] * k), theirs[part]).mean()),
    )
    angles = angles_between(up(dx * strength, dy * strength), theirs)
    both = np.corrcoef(np.concatenate([dx, dy]).ravel(), np.concatenate([tx, ty]).ravel())
    return Result(
        name,
        strength / heights.shape[1] * 100,
        float(both[0, 1]),
        float(np.corrcoef(dx.ravel(), tx.ravel())[0, 1]),
        float(np.corrcoef(dy.ravel(), ty.ravel())[0, 1]),
        float(angles.mean()),
        float(np.percentile(angles, 99)),
    )


@pytest.mark.parametrize("pair", sample([*MADE_PAIRS, *PAIRS[:4]], every=4), ids=lambda pair: pair.name)
def test_normals_of_heights_agree_with_the_normals_beside_them(pair: Pair, source: Source) -> None:
    found = compare(pair, source)
    assert found.strength > 0  # green and depth are as the manifest says
    assert min(found.along_x, found.along_y, found.correlation) >= pair.correlation
    assert found.mean_deg <= pair.mean_deg


def main() -> None:
    print(f"{'pair':22} {'filter':10} strength   corr      x      y   mean    p99 (degrees)")
    for pair in PAIRS:
        r = compare(pair, lambda name: Path(sys.argv[1]) / name.removeprefix("corpus/"))
        print(
            f"{pair.name:22} {r.filter_name:10} {r.strength:8.3f} {r.correlation:6.3f} {r.along_x:6.3f}"
            f" {r.along_y:6.3f} {r.mean_deg:6.2f} {r.p99_deg:6.2f}"
        )


if __name__ == "__main__":
    main()
