"""The rule for a scene's TOML: what `paradize bake` would refuse before it bakes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from paradize.checks.rules import Finding
from paradize.errors import GroupedError, ParadizeError
from paradize.scene.settings import load_scene


def check_settings(path: Path) -> Iterator[Finding]:
    """The faults of a scene's fields, and of the files that they name. Reads no source."""
    try:
        load_scene(path)
    except ParadizeError as refused:
        for error in refused.errors if isinstance(refused, GroupedError) else (refused,):
            yield Finding(
                "PZ431", error.file or str(path), error.what, error.place or "", mend=error.mend or ""
            )
