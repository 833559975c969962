"""The report of a bake in headless Chromium: no complaint, nothing fetched, readable on a phone."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import RENDER_ENVIRONMENT
from tests.e2e.browser import Browser, find_browser
from tests.pipeline.scenes import make_cove
from tests.places import ROOT


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The folder of reports, and what the bake said. One budget cannot be kept."""
    top = tmp_path_factory.mktemp("report")
    scene = make_cove(top / "scene")
    scene.write_text(scene.read_text() + "\n[budget]\ncolor_psnr_db = 30.0\nterrain_rms_m = 1e-9\n")
    command = [str(ROOT / "build/venv/bin/paradize"), "bake", str(scene), "-o", str(top / "cove"), "--json"]
    environment = {**os.environ, **RENDER_ENVIRONMENT, "PARADIZE_REPORT": str(top / "pages")}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300)
    assert done.returncode == 0, done.stderr
    return top / "pages", json.loads(done.stdout)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    program = find_browser()
    if program is None:
        pytest.skip("no chromium that is not a snap: Debian's package brings it, Ubuntu has none")
    with closing(Browser(program, tmp_path_factory.mktemp("profile"))) as opened:
        yield opened


@pytest.mark.parametrize("width", [360, 1400])
def test_the_report_opens_whole_and_tells_every_artifact(
    reported: tuple[Path, dict[str, Any]], browser: Browser, width: int
) -> None:
    folder, baked = reported
    browser.call(
        "Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=False
    )
    browser.open((folder / "index.html").as_uri())
    assert browser.complaints == []
    assert browser.run("performance.getEntriesByType('resource').length") == 0
    assert browser.run("document.documentElement.scrollWidth") <= width
    text = browser.run("document.body.textContent")
    assert [row["name"] for row in baked["artifacts"] if row["name"] not in text] == []
    drawn = browser.run("[...document.images].filter((image) => image.naturalWidth > 400).length")
    assert drawn == browser.run("document.images.length") == 1 + len(baked["sheets"])
    first = browser.run("document.querySelector('main').children[1].querySelector('img').alt")
    assert first == "cove at its poster second"


def test_the_report_marks_what_is_beyond_its_budget_and_nothing_else(
    reported: tuple[Path, dict[str, Any]], browser: Browser
) -> None:
    folder, baked = reported
    browser.open((folder / "cove/index.html").as_uri())
    rows = "[...document.querySelectorAll('.meter.bad')].map((meter) => meter.closest('tr'))"
    marked = browser.run(f"{rows}.map((row) => row.querySelector('th').firstChild.textContent)")
    over = [row["name"] for row in baked["artifacts"] if row["over"]]
    assert over and sorted(marked) == sorted(over)


def test_the_page_at_the_top_is_that_of_the_last_bake(reported: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = reported
    assert (folder / "index.html").read_bytes() == (folder / "cove/index.html").read_bytes()
