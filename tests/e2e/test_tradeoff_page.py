"""The page of `paradize measure` in headless Chromium: no complaint, nothing fetched, readable on a phone."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from paradize.report.tradeoff.page import tradeoff_page
from paradize.tradeoff.tiers import FileOptions, measure_file
from tests.e2e.browser import Browser, find_browser
from tests.pipeline.scenes import write_image


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
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


@pytest.mark.parametrize("width", [360, 1400])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_opens_whole_without_a_complaint_and_fetches_nothing(
    page: Path, browser: Browser, width: int, scheme: str
) -> None:
    browser.call(
        "Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=width < 600
    )
    scheme_is = {"name": "prefers-color-scheme", "value": scheme}
    browser.call("Emulation.setEmulatedMedia", features=[scheme_is])
    browser.open(page.as_uri())
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


def test_every_circle_label_and_line_lies_inside_its_picture(page: Path, browser: Browser) -> None:
    browser.open(page.as_uri())
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
