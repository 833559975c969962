"""The advice of `paradize measure` for random curves: no sentence contradicts another or compares two
series."""

from __future__ import annotations

import itertools
import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.report.tradeoff.page import _verdict
from paradize.tradeoff.curve import Group, Point, series_of
from paradize.tradeoff.words import advice, compare, conclude, disagreements, sentence
from tests.sweeps import tries

# The meaning of a sentence about two tiers: (the later, the earlier) -> its time and its error, -1 less, 1
# more.
Claims = dict[tuple[str, str], tuple[int, int]]
_TIME = (
    r"(t\d) (?:(costs|takes) \S+ x the time of|takes \S+ % (longer|less time) than"
    r"|takes about as long as) (t\d)"
)
_PAIR = re.compile(rf"{_TIME} and (has the same error|has \S+ % less|\w+)")
_TIMES = {"costs": 1, "longer": 1, "takes": -1, "less time": -1, "": 0}
_ERRORS = {"has the same error": 0, "leaves": -1, "halves": -1, "divides": -1, "has": 1}


def claims_of(text: str) -> Claims:
    """The comparisons in a sentence, by its words alone."""
    found: Claims = {}
    for after, ratio, share, before, words in _PAIR.findall(text.lower()):
        error = -1 if words.endswith("less") else _ERRORS[words]
        found[after, before] = _TIMES[ratio or share], error
    return found


@st.composite
def groups(draw: st.DrawFn) -> Group:
    """Measured curves: errors and times close together or far apart, in one series or several, by a metric of
    which less or more is better, with and without a budget and a tier in use."""
    less = draw(st.booleans())
    values = st.sampled_from(
        draw(st.sampled_from([(1.0, 1.01, 1.015), (1.0, 1.01, 1.03, 1.04), (0.0, 0.5, 1.0, 1.01, 8.0, 30.0)]))
        if less
        else draw(st.sampled_from([(30.0, 30.1), (30.0, 30.1, 30.25, 30.4), (20.0, 28.0, 36.0, 60.0, 200.0)]))
    )
    seconds = st.sampled_from([0.5, 0.99, 1.0, 1.01, 1.02, 2.0, 9.0])
    count = draw(st.sampled_from([1, 2, 3, 4, 5, 7]))
    used = draw(st.integers(-1, count - 1))
    names = draw(st.sampled_from([("a",), ("a",), ("a", "a", "b"), (None, "a", "b", "c")]))
    times, errors = ([draw(each) for _ in range(count)] for each in (seconds, values))
    if draw(st.booleans()):  # as tiers are meant to be: each takes longer and errs less, or nearly as much
        gains = [draw(st.sampled_from([0.1, 0.5, 0.9, 0.99, 1.0])) for _ in range(count)]
        times = [2.0**k for k in range(count)]
        errors = [
            math.prod(gains[:k]) if less else 30.0 - 20.0 * math.log10(math.prod(gains[:k]))
            for k in range(count)
        ]
    points: list[Point] = []
    for k in range(count):
        middle, spread = times[k], draw(st.sampled_from([0.001, 0.001, 0.002, 0.02, 0.3]))
        point: Point = {
            "tier": f"t{k}",
            "seconds": {
                "median": middle,
                "low": (1 - spread) * middle,
                "high": (1 + spread) * middle,
                "runs": 9,
            },
            "error": {"value": errors[k]},
            "bytes": draw(st.sampled_from([None, 100, 101, 400])),
            "in_use": k == used,
            "dominated": False,
            "on_front": False,
        }
        series = draw(st.sampled_from(names))
        if series:
            point["series"] = series
        if draw(st.integers(0, 4)) == 0:
            point["passes"] = False
        points.append(point)
    return {
        "name": "rock", "stage": "some", "kind": "bake", "artifact": "rock", "metric": "it",
        "unit": "units", "less_is_better": less, "time": "bake", "points": points,
        "budget": draw(st.none() | st.none() | values),
        "sentence": "", "declared": [point["tier"] for point in points] if draw(st.booleans()) else [],
    }  # fmt: skip


@given(groups())
@settings(deadline=None, max_examples=tries(100))
def test_no_sentence_compares_tiers_of_different_series(group: Group) -> None:
    warnings = conclude(group)
    points = {point["tier"]: point for point in group["points"]}
    claims = claims_of(group["sentence"])
    several = len(points) - len({series_of(point) for point in points.values()})
    assert len(claims) == several, "each tier is compared with the one before it of its series"
    for pair in claims:
        assert series_of(points[pair[0]]) == series_of(points[pair[1]])
    result = group.get("advice")
    saved = re.search(r"saves .* against (t\d)", result["text"]) if result else None
    if result and saved:
        assert series_of(points[saved[1]]) == series_of(points[result["tier"]])
    if result and result["why"] == "flat":
        names = re.findall(r"t\d", result["text"].partition("have the same error")[0].lower())
        assert len({series_of(points[name]) for name in names}) == 1
    for text in warnings:
        after, before = re.findall(r"(t\d) is declared .* than (t\d)", text)[0]
        assert series_of(points[after]) == series_of(points[before])


@given(groups())
@settings(deadline=None, max_examples=tries(100))
def test_tiers_that_are_said_to_err_alike_do_in_every_other_sentence(group: Group) -> None:
    warnings = conclude(group)
    result, claims = group.get("advice"), claims_of(group["sentence"])
    if not result or result["why"] != "flat":
        return
    names = re.findall(r"t\d", result["text"].partition("have the same error")[0].lower())
    points = {point["tier"]: point for point in group["points"]}
    whole = [tier for tier, point in points.items() if series_of(point) == series_of(points[names[0]])]
    assert names == whole and result["tier"] in names
    for (after, before), (time, error) in claims.items():
        if after in names:
            assert error == 0, "a tier that errs alike errs less or more than its neighbour"
        assert not (after == result["tier"] and time > 0), "the advised tier is slower"
        assert not (before == result["tier"] and time < 0), "another tier is quicker than the advised one"
    assert not any("declared more exact" in text and any(name in text for name in names) for text in warnings)


@given(groups())
@settings(deadline=None, max_examples=tries(100))
def test_where_the_curve_is_said_to_bend_no_sentence_finds_a_better_tier(group: Group) -> None:
    conclude(group)
    result = group.get("advice")
    if not result or result["why"] != "knee":
        return
    for (after, before), (time, error) in claims_of(group["sentence"]).items():
        if after == result["tier"]:
            assert not (time >= 0 and error >= 0 and (time, error) != (0, 0)), "no quicker and no nearer"
        if before == result["tier"]:
            assert not (time <= 0 and error <= 0 and (time, error) != (0, 0)), "its neighbour is better"


@given(groups())
@settings(deadline=None, max_examples=tries(100))
def test_a_warning_says_what_the_sentence_says(group: Group) -> None:
    warnings, claims = conclude(group), claims_of(group["sentence"])
    found = set()
    for text in warnings:
        after, word, before = re.findall(r"(t\d) is declared (slower|more exact) than (t\d)", text)[0]
        time, error = claims[after, before]
        assert time < 0 if word == "slower" else error > 0
        found.add((after, before, word))
    if group.get("declared"):
        for (after, before), (time, error) in claims.items():
            assert (time < 0) == ((after, before, "slower") in found)
            assert (error > 0) == ((after, before, "more exact") in found)


@given(groups())
@settings(deadline=None, max_examples=tries(100))
def test_the_page_asks_for_no_other_tier_than_the_advice(group: Group) -> None:
    conclude(group)
    kind, words = _verdict(group)
    result = group.get("advice")
    used = next((point["tier"] for point in group["points"] if point["in_use"]), None)
    named = re.findall(r"t\d", words)
    assert all(result and name == result["tier"] for name in named)
    if result and used and result["tier"] == used:
        assert kind in ("good", "plain")


@given(groups())
@settings(deadline=None, max_examples=tries(100))
def test_a_comparison_is_the_same_from_both_sides(group: Group) -> None:
    for a, b in itertools.product(group["points"], repeat=2):
        if series_of(a) != series_of(b):
            with pytest.raises(ValueError, match="different series"):
                compare(a, b, group)
            continue
        result, back = compare(a, b, group), compare(b, a, group)
        assert (result.time, result.error) == (-back.time, -back.error)


def test_a_dominated_tier_says_what_to_take_instead_and_why() -> None:
    def point(tier: str, seconds: float, value: float, in_use: bool) -> Point:
        spread = {"median": seconds, "low": 0.99 * seconds, "high": 1.01 * seconds, "runs": 9}
        return {
            "tier": tier, "seconds": spread, "error": {"value": value}, "bytes": None, "in_use": in_use,
            "dominated": False, "on_front": False,
        }  # type: ignore[typeddict-item]  # fmt: skip

    group: Group = {
        "name": "rock slopes", "stage": "slope filter", "kind": "bake", "artifact": "rock",
        "metric": "normal_p99_deg", "unit": "degrees", "less_is_better": True, "time": "bake", "budget": None,
        "points": [
            point("fast", 1.0, 0.2, False), point("balanced", 2.0, 0.2, False),
            point("exact", 4.0, 0.9, True),
        ],
        "sentence": "",
    }  # fmt: skip
    conclude(group)
    assert [one.get("instead") for one in group["points"]] == [
        None, "take fast: it is quicker and no worse", "take fast: it is quicker and more exact",
    ]  # fmt: skip
    result = group["advice"]
    assert result and result["tier"] == "fast" and result["why"] == "dominated"
    assert _verdict(group) == ("hint", "take fast")


def test_an_error_that_a_larger_format_takes_away_is_no_error_that_tiers_share() -> None:
    """Seen: "Tiers err alike: the quickest, fast, will do" beside "exact ... takes 71 % off the error"."""

    def point(tier: str, seconds: float, value: float, size: int, series: str) -> Point:
        spread = {"median": seconds, "low": 0.99 * seconds, "high": 1.01 * seconds, "runs": 9}
        return {
            "tier": tier, "seconds": spread, "error": {"value": value}, "bytes": size, "in_use": False,
            "dominated": False, "on_front": False, "series": series,
        }  # type: ignore[typeddict-item]  # fmt: skip

    group: Group = {
        "name": "rock colour", "stage": "block compression", "kind": "bake", "artifact": "rock",
        "metric": "color_psnr_db", "unit": "dB", "less_is_better": False, "time": "bake", "budget": None,
        "points": [
            point("fast", 1.0, 36.00, 100, "BC1"), point("balanced", 2.0, 36.05, 100, "BC1"),
            point("exact BC1", 9.0, 36.10, 100, "BC1"), point("exact", 9.0, 46.8, 200, "BC7"),
        ],
        "sentence": "", "declared": ["fast", "balanced", "exact"],
    }  # fmt: skip
    assert disagreements(group) == []
    conclude(group)
    assert sentence(group) == (
        "Balanced costs 2 x the time of fast and has the same error; exact BC1 costs 4.5 x the time of "
        "balanced and has the same error. Exact takes 9 s and 200 bytes; color_psnr_db is 46.8 dB."
    )
    result = advice(group)
    assert result is not None
    assert (
        result["text"]
        == "Fast, balanced and exact BC1 have the same error: take fast, none of them is quicker."
    )
