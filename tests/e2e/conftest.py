"""Shared by the tests of whole files: workers."""

from __future__ import annotations

from tests.pipeline.conftest import kept_workers

__all__ = ["kept_workers"]  # the fixture
