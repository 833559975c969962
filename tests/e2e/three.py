"""three.js in a headless Chromium, on a page of this folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import pytest

from tests.e2e.browser import Browser, find_browser, serve
from tests.places import ROOT


@dataclass
class ThreePage:
    """A page with `window.show`, and a folder that it loads from."""

    browser: Browser
    files: Path

    def take(self, query: dict[str, str], body: bytes) -> None:
        """What the page posts comes here."""
        raise NotImplementedError

    def run(self, file: str, data: bytes, call: str) -> dict[str, Any]:
        """What a call of the page says of a file; fails on any complaint of the console or of GL."""
        (self.files / file).write_bytes(data)
        found: dict[str, Any] = self.browser.run(call)
        assert self.browser.complaints == []
        assert found["error"] == 0
        return found


P = TypeVar("P", bound=ThreePage)


@contextmanager
def three_page(name: str, kind: type[P], temporary: pytest.TempPathFactory) -> Iterator[P]:
    """The page of that name; skips the test where there is no browser or no three.js."""
    program, three = find_browser(), ROOT / "build/node/node_modules/three"
    if program is None:
        pytest.skip("no chromium that is no snap: Debian's package brings it, Ubuntu has none")
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
