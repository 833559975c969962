"""What tests of the pipeline share: an exported terrain's picture is small, because drawing it takes seconds."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session", autouse=True)
def small_ground() -> Iterator[None]:
    """64 texels instead of 2048 a side. tests/e2e/test_export.py exports one in full."""
    with pytest.MonkeyPatch.context() as patch:
        for module in ("scene", "heights"):
            patch.setattr(f"paradize.export.{module}.GROUND_TEXELS", 64)
        yield
