"""How a picture becomes heights, and heights become slopes."""

from __future__ import annotations

from dataclasses import dataclass

from paradize.scene import ranges
from paradize.scene.schema import choice, flag, number

# The derivative filters that a user may name. "auto" chooses one by the heights (stages/filters.py).
FILTERS = ("auto", "central", "scharr", "fourth", "eighth")


@dataclass(frozen=True, kw_only=True)
class Relief:
    """How a picture becomes heights, and heights become slopes. The levels apply in the order of the
    fields, to values in 0..1."""

    black: float = number(0.0, **ranges.LEVEL, meaning="value of the picture that becomes height 0")
    white: float = number(1.0, **ranges.LEVEL, meaning="value that becomes height 1; must differ from black")
    gamma: float = number(1.0, **ranges.GAMMA, meaning="above 1 lifts the middle heights")
    contrast: float = number(1.0, **ranges.LEVEL, meaning="factor on heights around one half")
    brightness: float = number(0.0, **ranges.LEVEL, meaning="added to the heights")
    invert: bool = flag(False, meaning="white is low")
    filter: str = choice(
        "auto", among=FILTERS, meaning="derivative filter of the slopes; auto looks at the heights"
    )
    destep: bool = flag(False, meaning="smooth the steps of an 8-bit picture, within half a step")
