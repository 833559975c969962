"""FLIP without libm beside the authors' library, and what a switch of levels changes where that is known."""

from __future__ import annotations

import numpy as np
import pytest

from paradize.kernels.reference.seen import SeenLight, SeenMaterial, SeenMesh, flip, switch_flips
from paradize.metrics.picture import flip as flip_of_its_authors
from paradize.metrics.switch import switch_flip

FRONT = ((0.0, 0.0, 1.0),)
NIGHT = SeenLight((0.0, 1.0, 0.0), 0.0, 0.0)


@pytest.mark.parametrize("shape", [(1, 1), (3, 40), (33, 2), (48, 64)])
@pytest.mark.parametrize("change", [1, 40, 255])
def test_flip_is_that_of_its_authors(shape: tuple[int, int], change: int) -> None:
    rng = np.random.default_rng(3)
    a = rng.integers(0, 256, (*shape, 3))
    b = np.clip(a + rng.integers(-change, change + 1, a.shape), 0, 255).astype(np.uint8)
    a = a.astype(np.uint8)
    theirs = flip_of_its_authors(a.astype(np.float32) / 255, b.astype(np.float32) / 255)
    assert np.abs(flip(a, b) - theirs).max() < 2e-4
    assert not flip(a, a).any()


def plate(*glow: float) -> SeenMesh:
    """A square of 1 m that faces +Z, its left half and its right half as bright as given."""
    at = [[x, y, 0.0] for x in (0.0, 0.5, 1.0) for y in (0.0, 1.0)]
    triangles = [[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]]
    return SeenMesh(at, triangles, [glowing(one) for one in glow], [0, 0, 1, 1])


def glowing(bright: float) -> SeenMaterial:
    black, glow = (np.full((1, 1, 3), value, np.float32) for value in (0.0, bright))
    return SeenMaterial(colors=[black], glow=[glow])


def changed(a: SeenMesh, b: SeenMesh, background: int = 0, pixel: float = 0.01) -> float:
    return float(switch_flips(a, b, FRONT, pixel, NIGHT, samples=2, background=background)[0])


def test_a_switch_counts_over_the_box_of_the_object() -> None:
    dark, half, bright = plate(0.0, 0.0), plate(0.0, 1.0), plate(1.0, 1.0)
    assert changed(dark, dark) == 0.0
    assert changed(dark, bright) == pytest.approx(0.967, abs=0.04)  # black and white differ by that
    assert changed(dark, half) == pytest.approx(0.5 * changed(dark, bright), rel=0.1)
    assert changed(dark, bright, background=255) > 0.9


def test_a_part_that_vanishes_counts_by_what_stands_behind_it() -> None:
    whole = plate(1.0, 1.0)
    left = SeenMesh(whole.positions, whole.triangles[:2], [glowing(1.0)])
    assert changed(whole, left, background=0) > 0.4
    assert changed(whole, left, background=255) == 0.0


def leaf(alpha: float, *, two_sided: bool, turned: bool = False) -> SeenMesh:
    """A square of 1 m that faces +Z, or away, which glows; its alpha is tested at a half."""
    at = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    triangles = [[0, 2, 1], [0, 3, 2]] if turned else [[0, 1, 2], [0, 2, 3]]
    black, white = (np.full((1, 1, 3), value, np.float32) for value in (0.0, 1.0))
    holes = [np.full((1, 1), alpha, np.float32)]
    skin = SeenMaterial(alpha=holes, cutoff=0.5, two_sided=two_sided, colors=[black], glow=[white])
    return SeenMesh(at, triangles, [skin], uvs=[[0, 1], [1, 1], [1, 0], [0, 0]])


def test_a_back_face_counts_where_it_is_drawn_and_what_alpha_cuts_out_does_not() -> None:
    shown = leaf(0.9, two_sided=False)
    assert changed(shown, leaf(0.9, two_sided=False, turned=True)) > 0.9
    assert changed(shown, leaf(0.9, two_sided=True, turned=True)) == 0.0
    assert changed(shown, leaf(0.4, two_sided=True)) > 0.9  # all of it is a hole
    assert changed(leaf(0.4, two_sided=True), leaf(0.1, two_sided=True)) == 0.0


@pytest.mark.parametrize("size_px", [4.0, 30.0, 300.0, 4096.0])
def test_a_switch_to_the_same_level_changes_nothing_and_to_a_brighter_one_much(size_px: float) -> None:
    assert switch_flip(plate(0.2, 0.2), plate(0.2, 0.2), size_px) == 0.0
    assert switch_flip(plate(0.2, 0.2), plate(0.9, 0.9), size_px) > 0.02


def test_at_sizes_where_chance_decides_a_switch_counts_as_at_24_pixels() -> None:
    dim, bright = plate(0.2, 0.2), plate(0.2, 0.4)
    assert switch_flip(dim, bright, 4.0) == switch_flip(dim, bright, 24.0) != switch_flip(dim, bright, 48.0)


def test_what_cannot_be_compared_is_refused() -> None:
    picture = np.zeros((2, 2, 3), np.uint8)
    with pytest.raises(ValueError, match="cannot be compared"):
        flip(picture, picture[:1])
    with pytest.raises(ValueError, match="a pixel of 0"):
        changed(plate(0.0, 0.0), plate(0.0, 0.0), pixel=0.0)
    with pytest.raises(ValueError, match="directions"):
        switch_flips(plate(0, 0), plate(0, 0), [1.0], 0.1, NIGHT, samples=2, background=0)
