"""Drawn maps: how codes become normals and shares, which way green points, and pictures at another size."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from paradize.metrics.authored import true_normals, true_resized
from paradize.stages.authored import NormalCoding, decoded_normals, is_signed, shares, survey_normals
from paradize.stages.green import guess_green
from paradize.stages.resample import resized
from tests.pipeline import map_truth as truth
from tests.sweeps import tries

CODES = {np.uint8: 255, np.uint16: 65535}


def degrees(a: np.ndarray, b: np.ndarray) -> float:
    """The largest angle between unit vectors."""
    wide = np.linalg.norm(a.astype(np.float64) - b, axis=2)
    return float(np.degrees(2 * np.arcsin(np.clip(wide / 2, 0, 1))).max())


@pytest.mark.parametrize("kind", CODES)
def test_the_two_codes_in_the_middle_are_both_zero_and_the_ends_are_one(kind: Any) -> None:
    top = CODES[kind]
    texels = np.zeros((1, 4, 3), kind)
    texels[0, 0], texels[0, 1] = (top // 2, top // 2 + 1, top), (top // 2 + 1, top // 2, top)
    texels[0, 2], texels[0, 3] = (top, top // 2, top // 2), (0, top // 2, top // 2)
    found = decoded_normals(texels, NormalCoding())
    assert found[0].tolist() == [[0, 0, 1], [0, 0, 1], [1, 0, 0], [-1, 0, 0]]


CODINGS = st.builds(
    NormalCoding,
    without_z=st.booleans(),
    green_down=st.booleans(),
    scale=st.sampled_from([1.0, -1.0, 0.0, 0.25, 3.0, 1e6]),
)


@settings(max_examples=tries(60), deadline=None)
@given(
    texels=st.one_of(
        arrays(np.uint8, (3, 5, 3), elements=st.integers(0, 255)),
        arrays(np.uint16, (3, 5, 4), elements=st.integers(0, 65535)),
    ),
    coding=CODINGS,
)
def test_any_codes_become_unit_normals_above_the_surface_that_the_reference_agrees_with(
    texels: np.ndarray, coding: NormalCoding
) -> None:
    found = decoded_normals(texels, coding)
    assert np.abs(np.linalg.norm(found.astype(np.float64), axis=2) - 1).max() < 1e-6
    assert (found[:, :, 2] >= 0).all()
    wanted = true_normals(
        texels,
        signed=False,
        without_z=coding.without_z,
        green_down=coding.green_down,
        scale=coding.scale,
    )
    assert degrees(found, wanted) < 1e-4


@settings(max_examples=tries(40), deadline=None)
@given(
    vectors=arrays(np.float32, (2, 4, 3), elements=st.floats(-(2.0**127), 2.0**127, width=32)),
    signed=st.booleans(),
)
def test_floats_of_any_size_become_unit_normals(vectors: np.ndarray, signed: bool) -> None:
    found = decoded_normals(vectors, NormalCoding(signed=signed))
    assert np.abs(np.linalg.norm(found.astype(np.float64), axis=2) - 1).max() < 1e-6


def test_floats_of_unit_vectors_are_read_as_they_are_and_coded_ones_are_decoded() -> None:
    vectors = hills(24, 32)
    assert is_signed(vectors) and not is_signed((0.5 * vectors + 0.5).astype(np.float32))
    assert not is_signed(np.zeros((4, 4, 3), np.uint8))
    for texels, signed in ((vectors, True), ((0.5 * vectors + 0.5).astype(np.float32), False)):
        assert degrees(decoded_normals(texels, NormalCoding(signed=signed)), vectors) < 1e-3


def test_a_survey_counts_what_is_wrong_inside_alone() -> None:
    texels = np.full((2, 4, 3), (128, 128, 255), np.uint8)
    texels[0, 0], texels[0, 1], texels[0, 2] = 0, (128, 128, 128), (128, 128, 0)
    texels[1, 0] = 0
    inside = np.ones((2, 4), np.bool_)
    inside[1, 0] = False
    seen = survey_normals(texels, NormalCoding(), inside)
    assert (seen.texels, seen.black, seen.grey, seen.below, seen.off) == (7, 1, 1, 1, 1)
    assert (seen.largest, seen.side, seen.up) == (1.0, 0j, 3.0)
    assert seen + seen == type(seen)(14, 2, 2, 2, 2, 0j, 6.0, 1.0)


def test_normals_within_a_tenth_of_unit_length_are_no_fault() -> None:
    """JPEG and resizing leave them so."""
    z = np.array([0.85, 0.95, 1.0, 1.05, 1.15], np.float32)
    texels = np.stack([0 * z, 0 * z, z], axis=1)[None]
    assert survey_normals(texels, NormalCoding(signed=True), np.ones((1, 5), np.bool_)).off == 2


@settings(max_examples=tries(40), deadline=None)
@given(plane=arrays(np.uint16, (3, 4)), gain=st.floats(-2, 2), offset=st.floats(-1, 2))
def test_shares_are_the_nearest_floats_and_stay_within_0_and_1(
    plane: np.ndarray, gain: float, offset: float
) -> None:
    wanted = np.clip(offset + gain * (plane / 65535.0), 0.0, 1.0)
    assert np.abs(shares(plane, gain=gain, offset=offset) - wanted).max() <= 6e-8


# Which way green points.


def slopes_to_normals(along: np.ndarray, down: np.ndarray) -> np.ndarray:
    """Green up: x against the slope along the columns, y along the slope down the rows."""
    v = np.stack([-along, down, np.ones_like(along)], axis=2)
    return np.asarray(v / np.linalg.norm(v, axis=2, keepdims=True), np.float32)


def hills(rows: int, columns: int, seed: int = 1, steep: float = 1.5) -> np.ndarray:
    """Normals of smooth random heights."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:rows, 0:columns]
    along, down = np.zeros((rows, columns)), np.zeros((rows, columns))
    for _ in range(12):
        a, b, phase = *rng.uniform(-0.5, 0.5, 2), rng.uniform(0, 7)
        wave = np.cos(a * x + b * y + phase) * steep / 6
        along += a / 0.5 * wave
        down += b / 0.5 * wave
    return slopes_to_normals(along, down)


def flipped(normals: np.ndarray) -> np.ndarray:
    return np.asarray(normals * np.array([1, -1, 1], np.float32))


def coded(normals: np.ndarray) -> np.ndarray:
    """As 8 bits hold them."""
    return decoded_normals(np.rint(normals * 127.5 + 127.5).astype(np.uint8), NormalCoding())


@settings(max_examples=tries(25), deadline=None)
@given(seed=st.integers(0, 10_000), steep=st.floats(0.1, 6.0), rows=st.integers(16, 200))
def test_green_is_found_of_any_heights_and_turns_with_the_picture(seed: int, steep: float, rows: int) -> None:
    normals = coded(hills(rows, 96, seed, steep))
    assert guess_green(normals) == "up"
    assert guess_green(flipped(normals)) == "down"


@pytest.mark.parametrize("turn", [1, 2, 3])
def test_green_of_a_map_that_was_turned_with_its_vectors_is_found(turn: int) -> None:
    normals = hills(96, 128)
    angle = np.array([[0, -1], [1, 0]])  # up turns left with the picture
    turned = np.rot90(normals, turn).copy()
    turned[:, :, :2] = turned[:, :, :2] @ np.linalg.matrix_power(angle, turn).T.astype(np.float32)
    assert guess_green(coded(turned)) == "up"


NOISE = np.random.default_rng(3).normal(size=(2, 128, 128))
UNSURE = {
    "flat": slopes_to_normals(np.zeros((64, 64)), np.zeros((64, 64))),
    "tilted": slopes_to_normals(np.full((64, 64), 0.3), np.full((64, 64), 0.2)),
    "waves along x alone": slopes_to_normals(np.tile(np.sin(np.arange(96) / 3), (96, 1)), np.zeros((96, 96))),
    "slopes that have nothing to do with one another": slopes_to_normals(*NOISE),
    "half of it flipped": np.concatenate([hills(128, 256), flipped(hills(128, 256))], axis=0),
    "one texel": hills(1, 1),
    "one row": hills(1, 300),
    "two columns": hills(300, 2),
}


@pytest.mark.parametrize("name", UNSURE)
def test_green_is_not_guessed_where_the_slopes_do_not_tell(name: str) -> None:
    assert guess_green(UNSURE[name]) is None


# Another size.


@settings(max_examples=tries(60), deadline=None)
@given(
    plane=arrays(
        np.float32, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.floats(0, 1, width=32)
    ),
    rows=st.integers(1, 20),
    columns=st.integers(1, 20),
    wrap=st.tuples(st.booleans(), st.booleans()),
)
def test_a_plane_at_any_size_is_the_reference_s(
    plane: np.ndarray, rows: int, columns: int, wrap: tuple[bool, bool]
) -> None:
    found = resized(plane, rows, columns, wrap)
    assert np.abs(found - true_resized(plane.astype(np.float64), rows, columns, wrap)).max() < 1e-6
    assert plane.min() - 1e-6 <= found.min() and found.max() <= plane.max() + 1e-6


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (3, 2), (7, 12), (4, 13)])
def test_a_smaller_plane_holds_the_means_over_the_areas(rows: int, columns: int) -> None:
    plane = np.random.default_rng(2).random((7, 13)).astype(np.float32)
    wanted = truth.area_matrix(7, rows) @ plane @ truth.area_matrix(13, columns).T
    assert np.abs(resized(plane, rows, columns, (False, False)) - wanted).max() < 1e-6


def test_what_is_no_size_is_refused() -> None:
    with pytest.raises(ValueError, match="no texels"):
        resized(np.zeros((2, 2), np.float32), 0, 4, (True, True))
