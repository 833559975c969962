"""Long lists of cases: some of them in `make test`, all of them in `make deep`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings


def tries(count: int) -> int:
    """The number of cases for Hypothesis: a third of them in `make test`, which tries the same each time, all
    of them in `make deep`."""
    return max(4, count // 3) if settings.get_current_profile_name() == "same_cases" else count


def sweep(cases: Iterable[Any], *, test: Iterable[Any]) -> list[Any]:
    """The cases for `parametrize`: those in `test` run in both, the others are marked deep."""
    cases, taken = list(cases), list(test)
    assert taken and all(case in cases for case in taken), "cases of `make test` are cases of the sweep"
    return [case if case in taken else _deep(case) for case in cases]


def sample(cases: Iterable[Any], *, every: int) -> list[Any]:
    """The cases for `parametrize`, numbers or files of one kind: the first and each `every`th after it run in
    both, the others are marked deep. Cases of several kinds are named: `sweep`."""
    return [_deep(case) if at % every else case for at, case in enumerate(cases)]


def _deep(case: Any) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.deep)


# For a test of `sources` that is slow on those of the corpus.
CORPUS_DEEP = pytest.mark.parametrize("sources", sweep(["made", "corpus"], test=["made"]), indirect=True)
