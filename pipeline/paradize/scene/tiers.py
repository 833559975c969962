"""The tiers of the bakers, the cheapest first, and the names under which `auto` tells what it tried.

A texture's format grows last: a slower tier costs its baker time once, a larger format costs every player
memory.
"""

from __future__ import annotations

ORDER = ("fast", "balanced", "exact")
AUTO = "auto"  # the cheapest of them inside the budget
TIERS = (*ORDER, AUTO)
# A tier in its first texture format that keeps the budget.
FINER_FORMAT = tuple(f"{tier}, finer format" for tier in ORDER)
LABELS = (*ORDER, *FINER_FORMAT)
