"""The rule for a scene's TOML: what `paradize bake` would refuse before it bakes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path

from paradize.checks.rules import Finding
from paradize.checks.verdicts import with_severities, without_rule
from paradize.errors import GroupedError, ParadizeError
from paradize.scene.settings import load_scene


def _files(settings: object) -> Iterator[Path]:
    """The files that settings name, at any depth."""
    if isinstance(settings, Path):
        yield settings
    elif isinstance(settings, tuple):
        for setting in settings:
            yield from _files(setting)
    elif isinstance(settings, Mapping):
        yield from _files(tuple(settings.values()))
    elif is_dataclass(settings):
        yield from _files(tuple(getattr(settings, field.name) for field in fields(settings)))


def check_settings(path: Path, scenes: dict[str, int | None]) -> Iterator[Finding]:
    """The faults of a scene's fields, the files that they name and that do not exist, and codes that name no
    rule. Reads no model and no picture. scenes: takes how many files the scene names; None where it has
    faults."""
    scenes[str(path)] = None
    try:
        scene = load_scene(path)
    except ParadizeError as refused:
        for error in refused.errors if isinstance(refused, GroupedError) else (refused,):
            yield Finding(
                "PZ431", error.file or str(path), error.what, error.place or "", mend=error.mend or ""
            )
        return
    scenes[str(path)] = len(set(_files(scene)))
    unknown = without_rule(scene.check, [waiver.rule for waiver in scene.waivers], str(path))
    yield from with_severities(unknown, scene.check)
