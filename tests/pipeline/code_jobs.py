"""Jobs for the tests of the code's digests: a module that loads nothing of the pipeline itself."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any


def mark(path: Path) -> str:
    """Shows that it ran."""
    path.touch()
    return "done"


def import_late(path: Path) -> str:
    """Loads a stage with a kernel as it runs."""
    import paradize.build.measurements.gutter_limits  # noqa: F401

    return mark(path)


def run_and_tell(baker: str, arguments: dict[str, Any]) -> list[str]:
    """Runs a baker; every module of the package that is loaded afterwards."""
    from paradize.bakers import registry

    registry.BAKERS[baker][1](**arguments)
    return sorted(name for name in sys.modules if name.startswith("paradize."))
