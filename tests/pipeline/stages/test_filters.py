"""Promises of the derivative filters and of `auto` that picks among them."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.errors import BakeError
from paradize.kernels import filter as kernel
from paradize.kernels.normals import normals_from_heights
from paradize.stages.destep import destep
from paradize.stages.filters import TAPS, Taps, choose_filter, taps_of
from tests.pipeline.heights import angles_between, normals, rounded, sinusoids, up
from tests.processor_time import ratio
from tests.sweeps import sample

BOTH = (True, True)


def mean_angle(
    heights: np.ndarray, span: float, truth: np.ndarray, name: str, wrap: tuple[bool, bool] = BOTH
) -> float:
    found = normals(heights, scale=(span, span), wrap=wrap, filter_name=name)
    return float(angles_between(found, truth).mean())


# Filters that others use, weights of h[+k] - h[-k] and across: Sobel's; H. Farid and E. P. Simoncelli,
# "Differentiation of discrete multidimensional signals", 2004.
PLAIN = {
    "Sobel 3x3": Taps(np.array([1 / 2]), np.array([2, 1]) / 4),
    "Sobel 5x5": Taps(np.array([2, 1]) / 8, np.array([6, 4, 1]) / 16),
    "Farid-Simoncelli 5x5": Taps(np.array([0.276691, 0.109604]), np.array([0.426375, 0.249153, 0.037659])),
    **{name: TAPS[name] for name in ("central", "scharr", "fourth", "eighth")},
}


def plain_angle(heights: np.ndarray, span: float, truth: np.ndarray, name: str) -> float:
    found = normals_from_heights(
        heights,
        derivative=PLAIN[name].derivative,
        smooth=PLAIN[name].smooth,
        scale=(span, span),
        wrap=BOTH,
    )
    return float(angles_between(found, truth).mean())


# Taps


@pytest.mark.parametrize("name", TAPS)
def test_every_filter_is_exact_on_planes_and_on_quadratics(name: str) -> None:
    taps = TAPS[name]
    k = np.arange(1, len(taps.derivative) + 1)
    assert 2 * (taps.derivative * k).sum() == pytest.approx(1, abs=1e-12)
    assert taps.smooth[0] + 2 * taps.smooth[1:].sum() == pytest.approx(1, abs=1e-12)
    assert len(taps.derivative) <= kernel.REACH
    assert len(taps.smooth) <= kernel.REACH + 1


@pytest.mark.parametrize(("family", "degree"), [("smooth", 3), ("quintic", 5), ("septic", 7)])
def test_fitted_filters_are_the_least_squares_polynomials(family: str, degree: int) -> None:
    for name in (name for name in TAPS if name.startswith(family)):
        radius = int(name.removeprefix(family))
        k = np.arange(-radius, radius + 1)
        fit = np.linalg.pinv(np.vander(k / radius, degree + 1, increasing=True))
        assert np.allclose(TAPS[name].derivative, fit[1][radius + 1 :] / radius, atol=1e-9)
        assert np.allclose(TAPS[name].smooth, fit[0][radius:], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "degree"), [("central", 2), ("fourth", 4), ("eighth", 8), ("smooth6", 4), ("septic9", 8)]
)
def test_filters_have_the_order_that_their_names_say(name: str, degree: int) -> None:
    taps = TAPS[name]
    k = np.arange(1, len(taps.derivative) + 1) / len(taps.derivative)
    for odd in range(3, degree + 1, 2):
        assert abs(2 * (taps.derivative * k**odd).sum()) < 1e-9
    assert abs(2 * (taps.derivative * k ** (degree + 1)).sum()) > 1e-6


def test_an_unknown_filter_names_those_that_are_known() -> None:
    with pytest.raises(BakeError, match=r"'sobel'.*eighth"):
        taps_of("sobel")


# auto

# wavelengths, bits, the largest mean error in degrees that `balanced` may make at an rms slope of 1 over 512
# texels. The best plain filter (Sobel, Scharr, Farid and Simoncelli, orders 2 to 8) makes, in this order:
# 1.58, 1.77 and 0.91 from 8 bits; below 0.001, 0.0013 and 0.23 from floats.
COLUMNS = [
    (32, 256, 8, 0.5),
    (8, 64, 8, 1.0),
    (4, 16, 8, 1.1),
    (32, 256, 16, 0.02),
    (8, 64, 16, 0.05),
    (4, 16, 16, 0.3),
    (32, 256, 32, 0.001),
    (8, 64, 32, 0.01),
    (4, 16, 32, 0.3),
]


@pytest.mark.parametrize(("shortest", "longest", "bits", "limit"), sample(COLUMNS, every=14))
def test_auto_is_as_good_as_the_best_filter_of_every_column(
    shortest: int, longest: int, bits: int, limit: float
) -> None:
    for seed in range(2):
        field, dx, dy = sinusoids(512, shortest, longest, seed)
        heights, span = rounded(field, bits)
        truth = up(dx, dy)
        found = {
            tier: mean_angle(heights, span, truth, choose_filter(heights, bits, BOTH, tier))
            for tier in ("fast", "balanced", "exact")
        }
        assert found["balanced"] <= limit
        assert found["exact"] <= found["balanced"] * 1.02 + 0.001
        assert found["balanced"] < found["fast"]
        best = min(plain_angle(heights, span, truth, name) for name in PLAIN)
        assert found["balanced"] <= best + 0.001
        ours = ["septic4", "smooth5", "quintic8", "smooth10", "quintic16"]
        best = min(mean_angle(heights, span, truth, name) for name in ours)
        assert found["balanced"] <= best * 1.4 + 0.1 * (bits == 8) + 0.002


@pytest.mark.parametrize(("size", "rms_slope"), sample(product([96, 200, 512], [0.05, 0.5, 3.0]), every=9))
def test_auto_keeps_its_promise_over_sizes_slopes_and_seeds(size: int, rms_slope: float) -> None:
    for seed in range(10, 12 if size == 512 else 16):
        for shortest, longest in [(32, min(256, size)), (8, 64), (4, 16)]:
            field, dx, dy = sinusoids(size, shortest, longest, seed, rms_slope=rms_slope)
            truth = up(dx, dy)
            for bits in (8, 32):
                heights, span = rounded(field, bits)
                name = choose_filter(heights, bits, (False, False))
                found = mean_angle(heights, span, truth, name)
                plain = ["central", "scharr", "eighth", "smooth3"]
                best = min(mean_angle(heights, span, truth, other) for other in plain)
                assert found <= best * 1.15 + 0.002, (seed, shortest, bits, name)


def predicted(heights: np.ndarray, name: str, bits: int, dx: np.ndarray, dy: np.ndarray) -> float:
    """The error that is predicted for a filter on periodic heights, over the one that it makes: root mean
    squares of both axes against the true slopes."""
    taps = TAPS[name]
    found = kernel.predict_errors(heights, [(taps.derivative, taps.smooth)], source_bits=bits, wrap=BOTH)
    wide = heights.astype(np.float64)
    squares = 0.0
    for axis, exact in ((1, dx), (0, dy)):
        line = taps.smooth[0] * wide
        for k, w in enumerate(taps.smooth[1:], 1):
            line = line + w * (np.roll(wide, k, 1 - axis) + np.roll(wide, -k, 1 - axis))
        slope = sum(
            w * (np.roll(line, -k, axis) - np.roll(line, k, axis)) for k, w in enumerate(taps.derivative, 1)
        )
        squares += ((slope - exact) ** 2).mean()
    return float(found.errors[0] / np.sqrt(squares))


@pytest.mark.parametrize("name", ["central", "fourth", "eighth"])
@pytest.mark.parametrize(("shortest", "longest"), [(32, 256), (8, 64), (4, 16)])
def test_of_eight_bits_the_prediction_is_the_error(name: str, shortest: float, longest: float) -> None:
    """Steps of a code, and what a filter damps."""
    heights, dx, dy = sinusoids(512, shortest, longest, 3)
    codes, span = rounded(heights, 8)
    assert predicted(codes, name, 8, dx / span, dy / span) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize(
    "name", sample(["central", "scharr", "fourth", "eighth", "smooth2", "quintic4"], every=3)
)
def test_under_a_texture_of_the_finest_texels_codes_of_16_bits_round_as_they_do(name: str) -> None:
    """The texture is four times as strong as the rounding: where it stands, rounding never shows alone."""
    rows, top = 256, 65535
    k = 2.0 * np.pi * np.fft.fftfreq(rows)
    fine = (np.abs(k[None]) > 2.26) & (np.abs(k[:, None]) > 2.26)
    white = np.random.default_rng(1).normal(size=(rows, rows)) * np.sqrt(4 / 12)
    base = sinusoids(rows, 32, 256, 3)[0]
    spectrum = np.fft.fft2(500 + 3000 * (base - base.min()) / np.ptp(base)) + fine * np.fft.fft2(white)
    k[rows // 2] = 0.0
    heights, dx, dy = (
        np.fft.ifft2(part).real for part in (spectrum, 1j * k[None] * spectrum, 1j * k[:, None] * spectrum)
    )
    codes = (np.rint(heights) / top).astype(np.float32)
    assert predicted(codes, name, 16, dx / top, dy / top) == pytest.approx(1.0, rel=0.15)


@pytest.mark.parametrize(
    "name", sample(["central", "scharr", "fourth", "eighth", "smooth2", "quintic4"], every=3)
)
def test_of_what_is_folded_back_at_the_finest_texels_as_much_as_there_is_is_expected(name: str) -> None:
    """Heights that fall with the square of the frequency, sampled at every fourth place; the true slopes are
    those of the frequencies that the samples can hold."""
    fine, every = 1024, 4
    share = np.fft.fftfreq(fine)
    ideal = np.maximum(np.hypot(share[None], share[:, None]), 1 / fine) ** -2.0
    spectrum = ideal * np.fft.fft2(np.random.default_rng(1).normal(size=(fine, fine)))
    heights = np.fft.ifft2(spectrum).real[::every, ::every]
    held = (np.abs(share[None]) < 0.5 / every) & (np.abs(share[:, None]) < 0.5 / every)
    k = 2j * np.pi * every * share
    dx, dy = (np.fft.ifft2(axis * held * spectrum).real[::every, ::every] for axis in (k[None], k[:, None]))
    span = np.ptp(heights)
    floats = ((heights - heights.min()) / span).astype(np.float32)
    assert predicted(floats, name, 32, dx / span, dy / span) == pytest.approx(1.0, rel=0.1)


def test_eight_bit_data_in_a_file_of_sixteen_bits_or_floats_is_seen() -> None:
    field, dx, dy = sinusoids(512, 32, 256, 3)
    heights, span = rounded(field, 8)
    names = {choose_filter(heights, bits, BOTH) for bits in (8, 16, 32)}
    assert len(names) == 1
    assert mean_angle(heights, span, up(dx, dy), names.pop()) < 0.5
    found = kernel.predict_errors(heights, [], source_bits=16, wrap=BOTH)
    assert found.step == pytest.approx(1 / 255, rel=0.2)


def test_gentle_terraces_are_smoothed_and_floats_are_not() -> None:
    y, x = np.mgrid[0:256, 0:256]
    ramp = (0.11 * x + 0.07 * y).astype(np.float32)
    assert len(taps_of(choose_filter(np.rint(ramp) / np.float32(255), 8, (False, False))).derivative) >= 8
    field, _, _ = sinusoids(256, 5, 20, 1)
    assert choose_filter(field.astype(np.float32), 32, (False, False)) == "eighth"


def luminance(rgb: np.ndarray) -> np.ndarray:
    """Of 8-bit sRGB codes (h, w, 3), 0..1: IEC 61966-2-1 and BT.709."""
    share = rgb / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return (light @ (0.2126, 0.7152, 0.0722)).astype(np.float32)


@pytest.mark.deep
@pytest.mark.parametrize("tint", [[1.0, 0.95, 0.85], [1.0, 0.8, 0.6], [0.8, 0.9, 1.0]])
def test_steps_of_a_tinted_grey_are_those_of_its_channels(tint: list[float]) -> None:
    """Each channel is rounded by itself, so that luminances lie closer than codes do."""
    field, _, _ = sinusoids(512, 32, 256, 3)
    grey = 40 + 180 * (field - field.min()) / np.ptp(field)
    codes = luminance(np.repeat(np.arange(256)[:, None, None], 3, axis=2))[:, 0]
    heights = luminance(np.rint(grey[:, :, None] * tint))
    smooth = luminance(grey[:, :, None] * tint).astype(np.float64)
    truth = up(*(np.gradient(smooth, axis=axis) * 60 for axis in (1, 0)))

    def angle(name: str) -> float:
        found = normals(heights, scale=(60, 60), wrap=BOTH, filter_name=name)
        return float(angles_between(found, truth)[16:-16, 16:-16].mean())

    name = choose_filter(heights, 8, BOTH, codes=codes)
    assert angle(name) <= 1.5 * min(map(angle, TAPS)), name


def test_codes_of_a_wrong_shape_or_type_are_refused() -> None:
    for codes in (np.zeros((2, 2), np.float32), np.zeros(4)):
        with pytest.raises(ValueError, match="codes are"):
            kernel.predict_errors(np.zeros((4, 4), np.float32), [], source_bits=8, wrap=BOTH, codes=codes)


def test_a_mask_of_two_values_is_not_taken_for_noise() -> None:
    rng = np.random.default_rng(0)
    mask = np.kron(rng.integers(0, 2, (32, 32)), np.ones((8, 8))).astype(np.float32)
    for bits in (8, 16, 32):
        assert len(taps_of(choose_filter(mask, bits, BOTH)).derivative) <= 5


def test_exact_is_the_truths_own_filter_on_floats_and_balanceds_choice_on_codes() -> None:
    field, _, _ = sinusoids(256, 4, 16, 2)
    heights = field.astype(np.float32)
    assert choose_filter(heights, 32, BOTH, "exact") == "eighth"
    y, x = np.mgrid[0:256, 0:256]
    steps = np.rint(0.11 * x + 0.07 * y).astype(np.float32) / np.float32(255)
    assert choose_filter(steps, 8, BOTH, "exact") == choose_filter(steps, 8, BOTH, "balanced") != "eighth"


def test_a_filter_that_reads_more_is_taken_where_it_errs_less_by_a_fiftieth(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    heights = np.zeros((64, 64), np.float32)
    for share, name in ((0.99, "central"), (0.97, "fourth")):
        reach = {"central": 1.0, "fourth": share}

        def predicted(_: object, taps: list[Any], reach: Any = reach, **more: object) -> kernel.Prediction:
            names = [next(n for n, f in TAPS.items() if f.derivative is d and f.smooth is s) for d, s in taps]
            return kernel.Prediction(tuple(reach.get(n, 2.0) for n in names), 0.0)

        monkeypatch.setattr(kernel, "predict_errors", predicted)
        assert choose_filter(heights, 16, (True, True)) == name


def test_fast_never_looks_and_a_tier_that_is_none_is_refused() -> None:
    assert choose_filter(np.zeros((4, 4), np.float32), 8, BOTH, "fast") == "central"
    with pytest.raises(BakeError, match="'best'"):
        choose_filter(np.zeros((4, 4), np.float32), 8, BOTH, "best")


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (2, 300), (3, 3), (5, 9), (17, 4), (65, 130)])
@pytest.mark.parametrize("size", [0.0, 1e-30, 1.0, 1e30])
def test_auto_takes_maps_of_any_shape_and_size(shape: tuple[int, int], size: float) -> None:
    heights = np.random.default_rng(1).random(shape, np.float32) * np.float32(size)
    for bits in (8, 16, 32):
        name = choose_filter(heights, bits, (False, True))
        assert len(taps_of(name).derivative) <= max(1, min((n - 1 for n in shape if n > 1), default=1))
        found = normals(heights, wrap=(False, True), filter_name=name)
        assert np.isfinite(found).all()


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 1000), st.floats(0.01, 100.0))
def test_auto_does_not_care_how_high_a_float_map_stands(seed: int, factor: float) -> None:
    field, _, _ = sinusoids(64, 4, 32, seed)
    heights = field.astype(np.float32)
    turned = np.ascontiguousarray(heights.T)
    name = choose_filter(heights, 32, (False, False))
    assert choose_filter(heights * np.float32(2.0**7), 32, (False, False)) == name
    errors = [
        kernel.predict_errors(plane, [(t.derivative, t.smooth) for t in TAPS.values()], **settings_of())
        for plane in (heights, turned)
    ]
    assert np.allclose(errors[0].errors, errors[1].errors, rtol=1e-9)


def settings_of() -> dict[str, object]:
    return {"source_bits": 32, "wrap": (False, False)}


def test_what_lies_outside_all_islands_predicts_nothing() -> None:
    rng = np.random.default_rng(5)
    heights = rng.random((96, 160), np.float32)
    islands = np.where(np.arange(160) < 64, 0, -1).astype(np.int32) + np.zeros((96, 1), np.int32)
    other = np.where(islands < 0, np.float32(0.5), heights).astype(np.float32)
    filters = [(t.derivative, t.smooth) for t in TAPS.values()]
    first, second = (
        kernel.predict_errors(plane, filters, source_bits=32, wrap=(False, False), islands=islands)
        for plane in (heights, other)
    )
    assert first == second


def test_auto_looks_at_islands_one_by_one() -> None:
    field, _, _ = sinusoids(256, 32, 128, 5)
    heights, _ = rounded(field, 8)
    islands = np.full(heights.shape, -1, np.int32)
    islands[:, :120], islands[:, 130:] = 0, 1
    jumping = np.where(islands == 1, heights + np.float32(40), heights)
    jumping[islands < 0] = np.random.default_rng(0).random(int((islands < 0).sum()), np.float32)
    alone = len(taps_of(choose_filter(heights, 8, (False, False))).derivative)
    aware = len(taps_of(choose_filter(jumping, 8, (False, False), islands=islands)).derivative)
    assert aware >= alone / 2
    nowhere = np.full(heights.shape, -1, np.int32)
    assert choose_filter(heights, 8, (False, False), islands=nowhere) in TAPS


def test_a_look_costs_the_same_whatever_the_size() -> None:
    large = np.random.default_rng(0).random((4096, 1024), np.float32)
    small = large[:512, :512].copy()
    # 1.1; to look at all texels would take 16 times as long.
    assert ratio(lambda: choose_filter(large, 16, BOTH), lambda: choose_filter(small, 16, BOTH), turns=5) < 4


@pytest.mark.parametrize(
    ("array", "what"),
    [
        (np.zeros((4, 4)), "float64"),
        (np.zeros((4,), np.float32), r"\(4,\)"),
        (np.zeros((0, 4), np.float32), r"\(0, 4\)"),
    ],
)
def test_arrays_of_another_kind_are_refused(array: np.ndarray, what: str) -> None:
    with pytest.raises(ValueError, match=what):
        kernel.predict_errors(array, [], source_bits=8, wrap=BOTH)
    with pytest.raises(ValueError, match=what):
        kernel.destep(array, step=0.1, wrap=BOTH)


def main() -> None:
    """Prints the table of tests/bench/README.md."""
    fields = [(*waves, bits) for bits in (8, 32) for waves in ((32, 256), (8, 64), (4, 16))]
    table: dict[str, list[float]] = {}
    for shortest, longest, bits in fields:
        sums: dict[str, float] = {}
        for seed in range(4):
            field, dx, dy = sinusoids(1024, shortest, longest, seed)
            heights, span = rounded(field, bits)
            truth = up(dx, dy)
            found = {name: plain_angle(heights, span, truth, name) for name in PLAIN}
            for tier in ("balanced", "exact"):
                name = choose_filter(heights, bits, BOTH, tier)
                found[f"auto, {tier}"] = mean_angle(heights, span, truth, name)
            smooth = destep(heights, wrap=BOTH) if bits == 8 else heights
            found["de-stepped, fourth"] = mean_angle(smooth, span, truth, "fourth")
            for name, angle in found.items():
                sums[name] = sums.get(name, 0.0) + angle / 4
        for name, angle in sums.items():
            table.setdefault(name, []).append(angle)
    print(f"{'':22}", *(f"{low}-{high}, {bits} bit" for low, high, bits in fields), sep=" | ")
    for name, row in table.items():
        print(f"{name:22}", *(f"{angle:.4f}" for angle in row), sep=" | ")


if __name__ == "__main__":
    main()
