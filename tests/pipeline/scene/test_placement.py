"""How an instance stands, against a turn by a matrix."""

from __future__ import annotations

import numpy as np
import pytest

from paradize.scene.flight import sine_cosine
from paradize.scene.placement import to_world


@pytest.mark.parametrize("yaw_deg", [0.0, 37.0, 90.0, -200.0])
def test_an_instance_is_turned_about_y_then_scaled_then_moved(yaw_deg: float) -> None:
    points = np.random.default_rng(1).normal(size=(20, 3))
    angle = np.radians(yaw_deg)
    turn = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    position, scale = (3.0, -4.0, 5.0), 2.5
    expected = np.array(position) + scale * points @ np.transpose(turn)
    each = [to_world(point, position, sine_cosine(yaw_deg), scale) for point in points.tolist()]
    assert np.allclose(each, expected, rtol=0, atol=1e-12)
    at_once = np.stack(to_world(points.T, position, sine_cosine(yaw_deg), scale), axis=-1)
    assert np.array_equal(at_once, np.array(each))
