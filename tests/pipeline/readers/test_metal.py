"""A colour that is reflected becomes metalness: metal stays metal, what is none keeps its colour."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from paradize.material import PLASTIC_REFLECTANCE
from paradize.readers.metal import metal_of

SHARES = arrays(np.float64, 3, elements=st.floats(0.0, 1.0))
GOLD, SILVER, IRON = (1.0, 0.766, 0.336), (0.972, 0.960, 0.915), (0.56, 0.57, 0.58)


@pytest.mark.parametrize("metal", [GOLD, SILVER, IRON])
def test_what_reflects_alone_is_a_metal_of_its_colour(metal: tuple[float, ...]) -> None:
    color, metalness = metal_of((0.0, 0.0, 0.0), metal)
    assert float(metalness) == pytest.approx(1.0) and color == pytest.approx(metal)


@given(SHARES, st.floats(0.0, PLASTIC_REFLECTANCE))
def test_what_reflects_as_plastic_or_less_keeps_its_colour(diffuse: np.ndarray, reflected: float) -> None:
    color, metalness = metal_of(diffuse, np.full(3, reflected))
    assert float(metalness) == pytest.approx(0.0, abs=1e-9) and np.allclose(color, diffuse, atol=1e-9)
    blue = (0.0, 0.0, PLASTIC_REFLECTANCE + reflected)  # more than plastic of one colour, and still as dark
    color, metalness = metal_of(diffuse, blue)
    assert float(metalness) == 0.0 and np.array_equal(color, diffuse)


@given(SHARES, SHARES)
def test_the_light_of_both_kinds_together_is_kept(diffuse: np.ndarray, specular: np.ndarray) -> None:
    """The equation that the metalness solves: what a metal of the mean colour and plastic reflect together is
    as bright as what the file says is reflected. The colour goes from that of the diffuse light to that of
    the reflected one with its square."""
    color, metalness = metal_of(diffuse, specular)
    m = float(metalness)
    assert 0.0 <= m <= 1.0 and (color >= 0.0).all() and (color <= 1.0).all()

    def brightness(light: np.ndarray) -> float:
        return float(np.sqrt(0.299 * light[0] ** 2 + 0.587 * light[1] ** 2 + 0.114 * light[2] ** 2))

    if not 0.0 < m < 1.0:
        return
    scattered = brightness(diffuse) * (1.0 - specular.max()) / (1.0 - PLASTIC_REFLECTANCE)
    shown = (
        scattered + brightness(specular) - PLASTIC_REFLECTANCE * (1.0 - m)
    )  # brightness of the base colour
    assert shown * m + PLASTIC_REFLECTANCE * (1.0 - m) == pytest.approx(brightness(specular), abs=1e-9)
    of_diffuse = diffuse * (1.0 - specular.max()) / (1.0 - PLASTIC_REFLECTANCE) / max(1.0 - m, 1e-6)
    of_specular = (specular - PLASTIC_REFLECTANCE * (1.0 - m)) / max(m, 1e-6)
    mixed = (1.0 - m * m) * of_diffuse + m * m * of_specular
    assert np.allclose(color, np.clip(mixed, 0.0, 1.0), atol=1e-9)


def test_arrays_are_converted_place_by_place() -> None:
    rng = np.random.default_rng(3)
    diffuse, specular = rng.random((2, 5, 7, 3))
    color, metalness = metal_of(diffuse, specular)
    assert color.shape == (5, 7, 3) and metalness.shape == (5, 7)
    for at in np.ndindex(5, 7):
        one, share = metal_of(diffuse[at], specular[at])
        assert np.array_equal(one, color[at]) and share == metalness[at]
