"""Bakes that several tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport


def bake_apart(scene: Path, top: Path, *, whole: bool = False) -> BakeReport:
    """Bakes a scene, without an error, into top/out, with a store of its own, top/store. For fixtures of a
    module: `monkeypatch` is of one test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(top / "store"))
        report = bake(scene, top / "out", BuildOptions(jobs=1, whole=whole))
    assert not report.errors, report.errors
    return report
