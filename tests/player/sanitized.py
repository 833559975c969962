"""The player built with sanitizers: `make cpp-sanitized` leaves it in build/sanitize and build/threads."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import RENDER_ENVIRONMENT
from tests.places import ROOT

BUILDS = ("sanitize", "threads")


def play_sanitized(build: str, scene: Path, *options: object) -> dict[str, Any]:
    """The output of the player of this build with --json. Fails where the sanitizer finds something."""
    program = ROOT / "build" / build / "bin/paradize-player"
    if not program.is_file():
        pytest.fail(f"no {program.relative_to(ROOT)}: `make cpp-sanitized` builds it")
    # The thread sanitizer does not see what synchronises the graphics driver's own threads.
    environment = {
        "PARADIZE_SHADERS": str(ROOT / "shaders"),
        "TSAN_OPTIONS": "ignore_noninstrumented_modules=1",
    }
    result = subprocess.run(
        [str(program), str(scene), "--headless", "--json", *map(str, options)],
        capture_output=True, text=True, timeout=1800,
        env={**os.environ, **RENDER_ENVIRONMENT, **environment},
    )  # fmt: skip
    assert result.returncode == 0, result.stderr[-8000:]
    report: dict[str, Any] = json.loads(result.stdout)
    return report
