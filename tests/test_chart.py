"""The chart of the bench: every point is in it, told once, inside its panel, and no name covers another."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from tests.places import ROOT


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> tuple[Any, Any]:
    monkeypatch.syspath_prepend(str(ROOT / "tests/bench"))
    chart, row = importlib.import_module("chart"), importlib.import_module("row")
    monkeypatch.setattr(chart, "FOLDER", tmp_path)
    return chart, row


def test_points_are_multiples_of_our_fastest_tier_and_topics_add_up(bench: tuple[Any, Any]) -> None:
    chart, row = bench

    def measured(panel: str, ours: str, ms: float, peer_ms: float, error: float, share: float = 1.0) -> Any:
        trade = row.Trade(panel, ours, "peer", error, 0.5, share=share)
        return row.Row("w", ms, "p", peer_ms, "", "", inside="", ours_on="", peer_on="", trade=trade)

    rows = [measured("A: a", "exact", 30, 20, 0.25), measured("A: a", "fast", 10, 20, 1.0)]
    assert {name: at for _, name, *at in chart.keep(rows)["A: a"]} == {
        "exact": [3, 0.25], "peer": [2, 0.5], "fast": [1, 1],
    }  # fmt: skip
    both = chart.keep([measured("B: b", "fast", 1, 1, 1.0, share=0.5)])
    assert list(both) == ["A: a", "B: b"] and len(both["A: a"]) == 3
    root = ElementTree.parse(chart.draw([])).getroot()
    texts = [entry.text for entry in root.iter("{http://www.w3.org/2000/svg}text")]
    assert [texts.count(name) for name in ("exact", "fast", "peer", "A", "B")] == [1, 2, 2, 1, 1]


def test_names_that_find_no_room_are_an_error_not_a_smear(bench: tuple[Any, Any]) -> None:
    chart, _ = bench
    crowd = [("peer", f"a name as long as others {k}", 1.0 + k * 1e-6, 1.0) for k in range(40)]
    with pytest.raises(SystemExit, match="no room for"):
        chart.panel(60, "T: t", crowd)


def test_the_readme_shows_the_chart_and_the_chart_stands_on_a_ground_of_its_own() -> None:
    (shown,) = re.findall(r"!\[[^\]]+\]\((\S+\.svg)\)", (ROOT / "README.md").read_text())
    root = ElementTree.parse(ROOT / shown).getroot()
    assert root[0].get("fill") == "#ffffff" and root[0].get("width") == root.get("width")
