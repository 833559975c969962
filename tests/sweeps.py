"""Long lists of cases: some of them in `make test`, all of them in `make deep`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def sweep(cases: Iterable[Any], *, test: Iterable[Any]) -> list[Any]:
    """The cases for `parametrize`: those in `test` run in both, the others are marked deep."""
    cases, taken = list(cases), list(test)
    assert taken and all(case in cases for case in taken), "cases of `make test` are cases of the sweep"
    return [case if case in taken else _deep(case) for case in cases]


def _deep(case: Any) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.deep)
