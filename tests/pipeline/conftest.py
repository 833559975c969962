"""Shared by the tests of the pipeline: workers, and a small picture of an exported terrain."""

from __future__ import annotations

import io
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from paradize.cli.main import main
from tests.pipeline.bakes import bake_apart
from tests.pipeline.kept_workers import keeping_workers
from tests.pipeline.scenes import make_cove


@pytest.fixture(scope="session", autouse=True)
def kept_workers() -> Iterator[None]:
    """Bakes in this process share their workers."""
    with keeping_workers():
        yield


@pytest.fixture(scope="session")
def paradize_here() -> Callable[..., subprocess.CompletedProcess[str]]:
    """As `paradize`, in this process, whose workers are kept: for tests that do not judge the process."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        words = [str(word) for word in arguments]
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            code = main(words)
        return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())

    return run


@pytest.fixture(scope="session")
def baked_cove(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store that holds the cove's products. To be read: see cove_store."""
    top = tmp_path_factory.mktemp("baked_cove")
    bake_apart(make_cove(top / "scene"), top)
    return top / "store"


@pytest.fixture(scope="session")
def cove_store(baked_cove: Path) -> Callable[[Path], Path]:
    """Makes a store that holds the cove's products, for tests that begin with a cove that is baked."""

    def copy(folder: Path) -> Path:
        return Path(shutil.copytree(baked_cove, folder))

    return copy


@pytest.fixture(scope="session", autouse=True)
def few_samples() -> Iterator[None]:
    """5,000 points instead of 50,000 measure a level of a mesh that is baked in this process: they are most
    of a small bake's time. Workers keep to 50,000, and tests of metrics give a number of their own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("paradize.bakers.mesh.lods._SAMPLES", 5_000)
        yield


@pytest.fixture(scope="session", autouse=True)
def small_ground() -> Iterator[None]:
    """64 texels instead of 2048 a side: drawing it takes seconds. tests/e2e/test_export.py exports it all."""
    with pytest.MonkeyPatch.context() as patch:
        for module in ("scene", "heights"):
            patch.setattr(f"paradize.export.{module}.GROUND_TEXELS", 64)
        yield
