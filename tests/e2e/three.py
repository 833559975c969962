"""three.js in a headless Chromium, on a page of this folder."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.e2e.browser import Browser, find_browser, serve
from tests.places import ROOT

F64 = NDArray[np.float64]


def camera(manifest: dict[str, Any], second: float) -> tuple[F64, F64]:
    """Eye and target of the flight, from scene.json alone, as FORMAT.md tells."""
    flight = manifest["flight"]
    rows = np.array(flight["time_table"])
    k = min(int(np.searchsorted(rows[:, 0], second, side="right")) - 1, len(rows) - 2)
    (t0, u0, d0), (t1, u1, d1) = rows[k], rows[k + 1]
    x, h = (second - t0) / (t1 - t0), t1 - t0
    u = (2 * x**3 - 3 * x**2 + 1) * u0 + (x**3 - 2 * x**2 + x) * h * d0
    u += (3 * x**2 - 2 * x**3) * u1 + (x**3 - x**2) * h * d1
    at = min(int(u), len(flight["segments"]) - 1)
    powers = (u - at) ** np.arange(4)
    segment = flight["segments"][at]
    return np.array(segment["eye"]) @ powers, np.array(segment["target"]) @ powers


@dataclass
class ThreePage:
    """A page with `window.show`, and a folder that it loads from."""

    browser: Browser
    files: Path

    def take(self, query: dict[str, str], body: bytes) -> None:
        """Receives what the page posts."""
        raise NotImplementedError

    def run(self, file: str, data: bytes, call: str) -> dict[str, Any]:
        """The result of a call of the page for a file; fails on any complaint of the console or of GL."""
        (self.files / file).write_bytes(data)
        found: dict[str, Any] = self.browser.run(call)
        assert self.browser.complaints == []
        assert found["error"] == 0
        return found


@dataclass
class ExportPage(ThreePage):
    """show_export.html. drawn: what three.js drew, by second: (h, w, 4) bytes, or linear floats under a
    sky."""

    size: tuple[int, int] = (640, 360)
    drawn: dict[float, NDArray[Any]] = field(default_factory=dict)

    def take(self, query: dict[str, str], body: bytes) -> None:
        width, height = self.size
        kind = np.uint8 if len(body) == 4 * width * height else np.float32
        self.drawn[float(query["second"])] = np.frombuffer(body, kind).reshape(height, width, 4)

    def show(
        self, glb: bytes, seconds: tuple[float, ...], size: tuple[int, int], **more: object
    ) -> dict[str, Any]:
        """Draws an exported scene at each of the seconds. more: sky and hidden of show_export.mjs."""
        self.size = size
        self.drawn.clear()
        options = {"width": size[0], "height": size[1], "seconds": seconds, **more}
        return self.run("scene.glb", glb, f"window.show('scene', {json.dumps(options)})")


P = TypeVar("P", bound=ThreePage)


@contextmanager
def three_page(name: str, kind: type[P], temporary: pytest.TempPathFactory) -> Iterator[P]:
    """The page of that name; skips the test where there is no browser or no three.js."""
    program, three = find_browser(), ROOT / "build/node/node_modules/three"
    if program is None:
        pytest.skip("no chromium that is not a snap: Debian's package brings it, Ubuntu has none")
    if not three.is_dir():
        pytest.skip("no build/node/node_modules/three: `make setup-test` brings it")
    files = temporary.mktemp("files")
    folders = {"three": three, "page": ROOT / "tests/e2e", "files": files}
    with closing(Browser(program, temporary.mktemp("profile"))) as browser:
        page = kind(browser, files)
        with serve(folders, page.take) as address:
            browser.open(f"{address}/page/{name}")
            assert browser.complaints == []
            yield page
