"""Products and lengths of rows of vectors are those of floats, to the bit, in the order written here."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paradize.vectors import cross, cross_2d, dot, doubled_areas, doubled_areas_2d, lengths, squared_lengths

ROW = st.tuples(*[st.floats(-1e100, 1e100)] * 3)


@given(ROW, ROW)
def test_products_and_lengths_are_those_of_floats(
    a: tuple[float, float, float], b: tuple[float, float, float]
) -> None:
    rows_a, rows_b = np.array([b, a]), np.array([a, b])
    (ax, ay, az), (bx, by, bz) = a, b
    assert dot(rows_a, rows_b)[1] == ax * bx + ay * by + az * bz
    assert cross(rows_a, rows_b)[1].tolist() == [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
    assert cross_2d(rows_a[:, :2], rows_b[:, :2])[1] == ax * by - ay * bx
    assert squared_lengths(rows_a)[1] == ax * ax + ay * ay + az * az
    assert lengths(rows_a)[1] == sqrt(ax * ax + ay * ay + az * az)


def test_areas_are_doubled_and_signed_where_triangles_are_flat() -> None:
    corners = np.array([[[0.0, 0.0, 1.0], [3.0, 0.0, 1.0], [0.0, 4.0, 1.0]]])
    assert doubled_areas(corners).tolist() == doubled_areas_2d(corners[..., :2]).tolist() == [12.0]
    assert doubled_areas(corners[:, ::-1]).tolist() == [12.0]
    assert doubled_areas_2d(corners[:, ::-1, :2]).tolist() == [-12.0]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_float_types_are_kept_and_no_rows_have_no_lengths(dtype: type) -> None:
    for count in (0, 2):
        rows = np.ones((count, 3), dtype)
        assert lengths(rows).shape == (count,)
        assert all(made.dtype == dtype for made in (dot(rows, rows), cross(rows, rows), lengths(rows)))
