"""The tiers of the bakers, the cheapest first; the labels under which `auto` reports what it tried; the
libraries that some stages let users choose.

A texture's format grows last: a slower tier costs time once, in the bake; a larger format costs every player
memory.
"""

from __future__ import annotations

TIERS = ("fast", "balanced", "exact")
AUTO = "auto"  # the cheapest of them inside the budget
TIER_OPTIONS = (*TIERS, AUTO)
# A tier in its first texture format that keeps the budget.
FINER_FORMAT = tuple(f"{tier}, finer format" for tier in TIERS)
LABELS = (*TIERS, *FINER_FORMAT)
# Our own method is the first of each. Those of SEAM_SIMPLIFIERS keep attributes, seams and borders of
# materials; the others see positions alone (stages/lod, stages/unwrappers.py).
SEAM_SIMPLIFIERS = ("paradize", "meshoptimizer")
SIMPLIFIERS = (*SEAM_SIMPLIFIERS, "fast-simplification", "openmesh")
UNWRAPPERS = ("paradize", "xatlas")
