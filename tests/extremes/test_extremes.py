"""Every stage and metric at every extreme: finite and near the truth, or refused and why. In `make deep`: the
same bytes with two threads."""

from __future__ import annotations

import re

import pytest

from tests.extremes.__main__ import QUICK, TABLE, as_markdown, measured
from tests.extremes.table import DEEP, EXTREMES, Cell, cell_of, rows
from tests.places import ROOT

PACKAGE = ROOT / "pipeline/paradize"


ROWS = [row.name for row in rows()]
# Most of the time goes into these rows: `make deep` alone measures them in the columns that move, turn or
# scale what other columns hold.
SLOW = {
    "flight",
    "metrics.authored (resized)",
    "metrics.flight",
    "metrics.loading",
    "metrics.mapped_normal (normal)",
    "metrics.picture",
    "metrics.seen",
    "metrics.surface",
    "metrics.switch",
    "placement",
    "readers.obj (1e5 m away)",
    "readers.obj (1e6 m away)",
    "readers.stl (text)",
    "stages.atlas (paradize)",
    "stages.cubemap",
    "stages.occlusion",
    "stages.refine",
    "stages.sway",
    "stages.terrain (balanced)",
    "stages.terrain (fast)",
    "stages.unwrappers (xatlas)",
    "stages.validate",
}
MOVED = ("tiny", "far", "denormal", "parallel", "opposite", "mirrored", "sliver")
LATER = {
    (row.name, extreme)
    for row in rows()
    for extreme in (*DEEP, *(MOVED if row.name in SLOW else ()))
    if extreme in DEEP or extreme in row.inputs.keys() - row.refused.keys()
}


@pytest.fixture(scope="module")
def cells() -> dict[tuple[str, str], Cell]:
    """All but those of LATER, with one thread."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_THREADS", "1")
        wanted = ((row, extreme) for row in rows() for extreme in EXTREMES)
        return {
            (row.name, extreme): cell_of(row, extreme)
            for row, extreme in wanted
            if (row.name, extreme) not in LATER
        }


def test_no_row_is_slow_that_there_is_not() -> None:
    assert SLOW - {*ROWS} == set()


@pytest.mark.parametrize("row", ROWS)
def test_is_near_the_truth_or_refused(cells: dict[tuple[str, str], Cell], row: str) -> None:
    found = [cell for (name, _), cell in cells.items() if name == row]
    assert found and [cell for cell in found if cell.verdict == "fails"] == []


@pytest.mark.deep
def test_every_column_is_near_the_truth_and_has_the_same_bytes_with_two_threads() -> None:
    assert [cell for cell in measured(QUICK, QUICK) if cell.verdict == "fails"] == []


@pytest.mark.deep
@pytest.mark.parametrize("row", rows(), ids=lambda row: row.name)
def test_is_near_the_truth_at_large_sizes(row: object) -> None:
    for extreme in DEEP:
        cell = cell_of(row, extreme)  # type: ignore[arg-type]
        assert cell.verdict != "fails", f"{cell.said} error {cell.error}, limit {cell.limit} {cell.unit}"


def test_no_stage_and_no_metric_lacks_a_row() -> None:
    written = {
        ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        for room in ("stages", "metrics")
        for path in (PACKAGE / room).rglob("*.py")
        if path.stem != "__init__"
    }
    assert written - {row.module for row in rows()} == set(), "add a Row: tests/extremes/README.md"
    assert {row.module for row in rows()} - written == {
        "build.materials.model_facts",
        "flight",
        "placement",
        "readers.gltf",
        "readers.obj",
        "readers.stl",
    }


def test_every_row_names_every_extreme_once() -> None:
    names = [row.name for row in rows()]
    assert len(names) == len(set(names))
    for row in rows():
        assert set(row.inputs) | set(row.absent) == set(EXTREMES), row.name
        assert not set(row.inputs) & set(row.absent), row.name
        assert set(row.refused) <= set(row.inputs), row.name


def test_what_is_refused_names_what_is_wrong(cells: dict[tuple[str, str], Cell]) -> None:
    refused = [cell for cell in cells.values() if cell.verdict == "refused"]
    assert len(refused) > 100
    for cell in refused:
        assert len(cell.said.split()) >= 2 and "Traceback" not in cell.said, cell


def _shape(page: str) -> list[str]:
    """The page without the errors' digits: what it says of each cell, and every message."""
    return [re.sub(r"(?<=\| )[0-9][0-9.e+-]*(?= \|)", "#", line) for line in page.splitlines()]


def test_the_page_is_what_the_cells_say(cells: dict[tuple[str, str], Cell]) -> None:
    """But for what `make deep` and `make extremes` alone measure, and for digits of the errors."""
    page = TABLE.read_text()
    later = {
        (row.name, extreme): Cell(row.name, extreme, "holds", 0.0, row.limit, row.unit, "", "")
        if extreme in row.inputs
        else Cell(row.name, extreme, "absent", None, row.limit, row.unit, row.absent[extreme], "")
        for row in rows()
        for extreme in EXTREMES
        if (row.name, extreme) in LATER
    }
    result = [cells.get((row, extreme)) or later[row, extreme] for row in ROWS for extreme in EXTREMES]
    assert _shape(as_markdown(result)) == _shape(page)
