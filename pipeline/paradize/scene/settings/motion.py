# ruff: noqa: RUF009 (the calls in the dataclasses make their fields)
"""How objects move: round an ellipse, with wings or legs that beat."""

from __future__ import annotations

from dataclasses import dataclass

from paradize.scene.schema import FAR, choice, number, table, vector, whole

MOST_LAPS, MOST_BEATS = 10_000, 100_000
MOST_PAUSE = 0.9  # of the time
QUARTER_DEG = 90.0


@dataclass(frozen=True, kw_only=True)
class Beat:
    """Wings or legs: what is farther than `hinge_m` from the plane x = 0 of the mesh turns about the
    hinge."""

    per_lap: int = whole(low=1, high=MOST_BEATS, meaning="beats in a round; in a pause it stops too")
    hinge_m: float = number(
        0.0,
        low=0.0,
        high=1e4,
        unit="m",
        meaning="half the width of what stands still, in the mesh's own units",
    )
    lift_deg: float = number(
        0.0, low=0.0, high=QUARTER_DEG, unit="degrees", meaning="how far it turns up, and down"
    )
    swing_deg: float = number(
        0.0, low=0.0, high=QUARTER_DEG, unit="degrees", meaning="how far it turns forwards, and back"
    )
    lag_deg_per_m: float = number(
        0.0,
        low=0.0,
        high=1e5,
        unit="degrees/m",
        meaning="how much later what is farther from the hinge beats",
    )
    stagger_deg_per_m: float = number(
        0.0, low=0.0, high=1e5, unit="degrees/m", meaning="how much earlier what lies farther along Z beats"
    )
    glides: int = whole(0, low=0, high=MOST_LAPS, meaning="times in a round that it comes to rest")
    glide_share: float = number(
        0.0, low=0.0, high=MOST_PAUSE, unit="of the time", meaning="how long it rests then"
    )


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Each instance moves round an ellipse in its own plane, about its position; each begins at another place
    of it. Rounds are whole, so that the flight's end meets its beginning."""

    laps: int = whole(
        low=-MOST_LAPS,
        high=MOST_LAPS,
        meaning="rounds in the flight's duration: from the instance's X towards its Z, negative: back; not 0",
    )
    radius_m: tuple[float, float] = vector(
        size=2, low=0.0, high=FAR, unit="m", meaning="half axes of the ellipse, along the instance's X and Z"
    )
    rise_m: float = number(
        0.0, low=0.0, high=FAR, unit="m", meaning="how far it rises and sinks, twice in a round"
    )
    heading: str = choice(
        "ahead",
        among=("ahead", "fixed"),
        meaning="ahead: the mesh's +Z points along its way; fixed: it keeps its direction, as a crab that "
        "walks sideways",
    )
    bank_deg: float = number(
        0.0, low=-QUARTER_DEG, high=QUARTER_DEG, unit="degrees", meaning="how far it rolls into the turn"
    )
    pauses: int = whole(0, low=0, high=MOST_LAPS, meaning="stops in a round")
    pause_share: float = number(
        0.0, low=0.0, high=MOST_PAUSE, unit="of the time", meaning="how long it stands still at its stops"
    )
    beat: Beat | None = table(Beat, None, meaning="Its wings or legs.")
