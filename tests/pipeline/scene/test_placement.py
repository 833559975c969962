"""How an instance stands, against turns by matrices in float64."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paradize.placement import largest_scale, to_world, turned, turned_back
from paradize.scene.placement import placed
from paradize.scene.settings import Instance

ANGLES = st.floats(-720.0, 720.0)
SCALES = st.floats(0.01, 100.0).flatmap(lambda size: st.sampled_from([size, -size]))
INSTANCES = st.builds(
    Instance,
    position=st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    yaw_deg=ANGLES,
    pitch_deg=ANGLES,
    roll_deg=ANGLES,
    scale=SCALES | st.tuples(SCALES, SCALES, SCALES),
)
POINTS = np.random.default_rng(1).normal(size=(20, 3))


def about(axis: int, degrees: float) -> Any:
    """The matrix of a turn about X, Y or Z, counter-clockwise seen from the axis' end."""
    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[[i, i, j, j], [i, j, i, j]] = cosine, -sine, sine, cosine
    return matrix


def matrix_of(instance: Instance) -> Any:
    turn = about(1, instance.yaw_deg) @ about(0, instance.pitch_deg) @ about(2, instance.roll_deg)
    return turn @ np.diag(np.broadcast_to(instance.scale, 3))


@given(INSTANCES)
def test_an_instance_is_scaled_then_rolled_pitched_and_yawed_then_moved(instance: Instance) -> None:
    expected = POINTS @ matrix_of(instance).T + instance.position
    each = [to_world(point, placed(instance)) for point in POINTS.tolist()]
    assert np.allclose(each, expected, rtol=1e-12, atol=1e-9)
    at_once = np.stack(to_world(POINTS.T, placed(instance)), axis=-1)
    assert np.array_equal(at_once, np.array(each))


@given(INSTANCES)
def test_the_rotation_is_a_unit_quaternion_whatever_the_scale(instance: Instance) -> None:
    """A mirrored instance keeps a proper rotation: the mirror is in its scale."""
    rotation = placed(instance)["rotation"]
    assert np.dot(rotation, rotation) == pytest.approx(1.0, abs=1e-14)
    there = [turned(tuple(point), rotation) for point in np.eye(3).tolist()]
    assert np.linalg.det(there) == pytest.approx(1.0, abs=1e-12)
    back = [turned_back(point, rotation) for point in there]
    assert np.allclose(back, np.eye(3), rtol=0, atol=1e-12)
    mirrored = np.sign(np.linalg.det(matrix_of(instance)))
    assert mirrored == np.sign(np.prod(placed(instance)["scale"]))


@given(INSTANCES)
def test_no_distance_grows_by_more_than_the_largest_scale(instance: Instance) -> None:
    there = np.array([to_world(point, placed(instance)) for point in POINTS.tolist()])
    before = np.linalg.norm(POINTS[:, None] - POINTS, axis=2)
    after = np.linalg.norm(there[:, None] - there, axis=2)
    assert (after <= before * largest_scale(placed(instance)) * (1 + 1e-9) + 1e-9).all()


@given(INSTANCES)
def test_frames_of_mirrored_and_uneven_instances_stay_perpendicular(instance: Instance) -> None:
    """A normal divided by the scales, then turned, is perpendicular to every moved edge of its plane."""
    entry = placed(instance)
    edges = np.array([[1.0, 2.0, -0.5], [0.3, -1.0, 2.0]])
    normal = np.cross(*edges) / entry["scale"]
    there = np.array([turned(tuple(edge * entry["scale"]), entry["rotation"]) for edge in edges])
    turned_normal = np.array(turned(tuple(normal), entry["rotation"]))
    lengths = np.linalg.norm(there, axis=1) * np.linalg.norm(turned_normal)
    assert (np.abs(there @ turned_normal) <= 1e-9 * lengths).all()
