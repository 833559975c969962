"""The pages of a bake and of `paradize measure` in headless Chromium: no complaint, nothing fetched, readable
on a phone."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.cli.main import main
from paradize.report.tradeoff.page import tradeoff_page
from paradize.tradeoff.tiers import FileOptions, measure_file
from tests.conftest import RENDER_ENVIRONMENT
from tests.e2e.browser import Browser, find_browser
from tests.pipeline.material_scene import make_panels
from tests.pipeline.scenes import write_image
from tests.sweeps import sweep


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The folder of reports, and what the bake said. One budget cannot be kept."""
    top = tmp_path_factory.mktemp("report")
    scene = make_panels(top / "scene")
    scene.write_text(scene.read_text() + "\n[budget]\ncolor_psnr_db = 30.0\nnormal_p99_deg = 1e-9\n")
    said = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(said):
        for name, value in RENDER_ENVIRONMENT.items():
            patch.setenv(name, value)
        patch.setenv("PARADIZE_REPORT", str(top / "pages"))
        patch.setenv("PARADIZE_STORE", str(top / "store"))
        assert main(["bake", str(scene), "-o", str(top / "panels"), "--json"]) == 0
    return top / "pages", json.loads(said.getvalue())


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    program = find_browser()
    if program is None:
        if os.environ.get("CI"):
            pytest.fail("no Chromium: apt-get install chromium")
        pytest.skip("no Chromium to open the page with")
    opened = Browser(program, tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.mark.parametrize("width", sweep([360, 1400], test=[360]))
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
    assert first == "panels at its poster second"


def test_the_report_marks_what_is_beyond_its_budget_and_nothing_else(
    reported: tuple[Path, dict[str, Any]], browser: Browser
) -> None:
    folder, baked = reported
    browser.open((folder / "panels/index.html").as_uri())
    rows = "[...document.querySelectorAll('.meter.bad')].map((meter) => meter.closest('tr'))"
    marked = browser.run(f"{rows}.map((row) => row.querySelector('th').firstChild.textContent)")
    over = [row["name"] for row in baked["artifacts"] if row["over"]]
    assert over and sorted(marked) == sorted(over)


def test_the_page_at_the_top_is_that_of_the_last_bake(reported: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = reported
    assert (folder / "index.html").read_bytes() == (folder / "panels/index.html").read_bytes()


@pytest.fixture(scope="module")
def tradeoff(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tradeoff")
    noise = np.random.default_rng(3).integers(0, 255, (36, 36, 3), np.uint8)
    write_image(folder / "<b>rock & sand.png", noise)
    report = measure_file(folder / "<b>rock & sand.png", FileOptions(), runs=1)
    report["attribution"] = [
        {"stage": "terrain", "flip_mean": 0.01, "flip_p99": 0.2, "flip_max": 0.5},
        {"stage": "levels of detail", "flip_mean": 0.02, "flip_p99": 0.3, "flip_max": 0.6},
    ]
    report["groups"][0]["budget"] = 36.0
    path = folder / "tradeoff.html"
    path.write_text(tradeoff_page(report))
    return path


@pytest.mark.parametrize(
    ("width", "scheme"),
    sweep(
        [(360, "light"), (360, "dark"), (1400, "light"), (1400, "dark")],
        test=[(360, "light"), (1400, "dark")],
    ),
)
def test_the_page_opens_whole_without_a_complaint_and_fetches_nothing(
    tradeoff: Path, browser: Browser, width: int, scheme: str
) -> None:
    browser.call(
        "Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=width < 600
    )
    scheme_is = {"name": "prefers-color-scheme", "value": scheme}
    browser.call("Emulation.setEmulatedMedia", features=[scheme_is])
    browser.open(tradeoff.as_uri())
    assert browser.complaints == []
    assert browser.run("performance.getEntriesByType('resource').length") == 0
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.run("document.querySelectorAll('b').length") == 0  # a file's name is text
    assert browser.run("document.querySelectorAll('section.card').length") == 6
    assert browser.run("document.querySelectorAll('section.card > svg').length") == 5  # du/dv has one tier
    ink, paper = browser.run(
        "[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]"
    )
    dark = sum(map(int, paper[4:-1].split(","))) < sum(map(int, ink[4:-1].split(",")))
    assert dark == (scheme == "dark")


def test_every_circle_label_and_line_lies_inside_its_picture(tradeoff: Path, browser: Browser) -> None:
    browser.open(tradeoff.as_uri())
    outside = browser.run(
        """[...document.querySelectorAll('section.card > svg')].flatMap((svg) => {
            const frame = svg.viewBox.baseVal;
            return [...svg.querySelectorAll('text, circle, path')].filter((part) => {
                const box = part.getBBox(), matrix = part.getCTM(), own = svg.getCTM();
                const map = own.inverse().multiply(matrix);
                const a = new DOMPoint(box.x, box.y).matrixTransform(map);
                const b = new DOMPoint(box.x + box.width, box.y + box.height).matrixTransform(map);
                return Math.min(a.x, b.x) < -1 || Math.max(a.x, b.x) > frame.width + 1
                    || Math.min(a.y, b.y) < -1 || Math.max(a.y, b.y) > frame.height + 1;
            }).map((part) => part.outerHTML);
        })"""
    )
    assert outside == []
