"""Explains which limit decides how coarse a level of an object's maps may be sampled."""

from __future__ import annotations

from typing import Any


def decides(gutter: dict[str, Any]) -> list[str]:
    """In words: which limit decides how coarse a level of the map may be sampled."""
    p99, worst, bound = gutter["bleed_p99"], gutter["bleed_max"], gutter["bound"]
    last, safe, in_use = len(p99) - 1, gutter["max_level"], gutter["level_in_use"]
    words = []
    if gutter["width_texels"] is None:
        words.append("one island: there is no other island to bleed in")
    elif gutter["level_by_width"] >= in_use:
        words.append(f"the width alone is enough for level {in_use}, the coarsest that the flight uses")
    else:
        by_width = gutter["level_by_width"]
        reached = f"for level {by_width} at most" if by_width >= 0 else "for no level"
        words.append(f"the width alone is enough {reached}; the colours of neighbours decide")
    if safe is None:
        words.append(
            f"at every level at most {max(p99):.3g} bleeds in (99 of 100 samples; {bound:g} is accepted), "
            "so that none is left out"
        )
        return words
    after = safe + 1
    if p99[after] > bound:
        words.append(
            f"level {after} would bleed by {p99[after]:.3g} (99 of 100 samples; {bound:g} is accepted), so "
            f"level {safe} of {last} is the last that is sampled"
        )
    else:
        words.append(
            f"at level {after} a sample would be off by {worst[after]:.3g} (none may be by more than "
            f"{2.5 * bound:g}), so level {safe} of {last} is the last that is sampled"
        )
    if safe < in_use:
        words.append(
            f"the flight would use level {in_use}: the object may shimmer from afar; move its islands apart, "
            "paint neighbours alike, or accept more with the object's bleed; islands are not repacked, for "
            "their maps are painted pictures"
        )
    return words
