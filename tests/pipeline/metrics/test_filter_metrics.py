"""Promises of the metrics of derivative filters: their taps, and what a filter alone costs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from paradize.data import HeightMap
from paradize.metrics import levels
from paradize.metrics.filters import central_weights, fitted_weights, taps
from paradize.stages.filters import TAPS, taps_of
from tests.pipeline.heights import waves


@pytest.mark.parametrize("name", TAPS)
def test_every_filter_of_the_stages_is_the_one_that_the_metrics_derive(name: str) -> None:
    own = taps(name)
    stage = taps_of(name)
    for found, wanted in zip(own, (stage.derivative, stage.smooth), strict=True):
        assert len(found) == len(wanted)
        assert np.abs(np.array(found) - wanted).max() < 1e-15


def test_a_filter_error_leaves_out_what_crosses_from_one_island_to_another() -> None:
    heights = waves(64, 64, 2, 10.0)
    heights[:, 32:] += 100.0
    islands = np.zeros((64, 64), np.int32)
    islands[:, 32:] = 1
    ground = HeightMap(heights, (1.0, 1.0), (True, True), "central")
    torn = levels.filter_error(ground)
    whole = levels.filter_error(replace(ground, islands=islands))
    assert whole["max_deg"] < 0.5 * torn["max_deg"]
    nowhere = levels.filter_error(replace(ground, islands=np.full((64, 64), -1, np.int32)))
    assert nowhere == {"mean_deg": 0.0, "p99_deg": 0.0, "max_deg": 0.0}


def test_a_filter_error_is_nothing_for_the_filter_it_is_measured_by_and_grows_with_steepness() -> None:
    heights = waves(64, 64, 2, 10.0)
    errors = {
        name: levels.filter_error(HeightMap(heights, (1, 1), (True, True), name))
        for name in ("eighth", "fourth", "central")
    }
    assert errors["eighth"] == {"mean_deg": 0.0, "p99_deg": 0.0, "max_deg": 0.0}
    assert 0 < errors["fourth"]["mean_deg"] < errors["central"]["mean_deg"] < errors["central"]["p99_deg"]
    assert errors["central"]["p99_deg"] <= errors["central"]["max_deg"]


def test_weights_are_exact_for_the_polynomials_that_they_are_made_for() -> None:
    assert central_weights(4) == (4 / 5, -1 / 5, 4 / 105, -1 / 280)
    k = np.arange(1, 7)
    for degree in (3, 5, 7):
        slope, value = fitted_weights(6, degree)
        for power in range(degree + 1):
            line = np.float64(power % 2) * 2 * (k.astype(np.float64) ** power)
            assert (slope * line).sum() == pytest.approx(1.0 if power == 1 else 0.0, abs=1e-9)
            even = np.float64(power % 2 == 0) * 2 * (k.astype(np.float64) ** power)
            centre = value[0] if power == 0 else 0.0
            wanted = 1.0 if power == 0 else 0.0
            assert centre + (np.array(value[1:]) * even).sum() == pytest.approx(wanted, abs=1e-9)
