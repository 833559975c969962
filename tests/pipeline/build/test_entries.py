"""Entries of the store may have any shape: those that do not fit count as not there."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from paradize.build import provenance
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport, is_record, record_name, unchanged_bake
from paradize.documents import json_text
from paradize.explain.facts import explain
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Store, seal, unseal, unseal_lines
from tests.pipeline.scenes import make_cove
from tests.sweeps import sweep

DEEP = b"[" * 100_000 + b"]" * 100_000


def long_number(tree: Any) -> Any:
    """Every number of 401 digits."""
    return json.loads(json.dumps(tree), parse_float=lambda _: 10**400, parse_int=lambda _: 10**400)


def other(tree: Any) -> Any:
    """Every value of another kind."""
    if isinstance(tree, dict):
        return {key: other(value) for key, value in tree.items()}
    if isinstance(tree, list):
        return [other(value) for value in tree]
    return 7 if isinstance(tree, str) or tree is None else "x"


def shorter(tree: Any) -> Any:
    """Every table without its last key."""
    if isinstance(tree, dict):
        return {key: shorter(value) for key, value in list(tree.items())[:-1]}
    return [shorter(value) for value in tree] if isinstance(tree, list) else tree


WRONG: dict[str, Callable[[Any], Any]] = {
    "long numbers": long_number,
    "other kinds": other,
    "missing keys": shorter,
    "a list": lambda tree: [tree],
    "a path for a suffix": lambda tree: json.loads(json.dumps(tree).replace('"ktx2"', '"/../ktx2"')),
    "a path for a hash": lambda tree: json.loads(
        json.dumps(tree).replace('"sha256": "', '"sha256": "../../../')
    ),
}


@pytest.fixture
def cove(
    tmp_path: Path, cove_store: Callable[[Path], Path], monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Path, Path, Path]]:
    """The scene, its bake and the store."""
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    scene = make_cove(tmp_path / "cove")
    assert not bake(scene, tmp_path / "out", BuildOptions(jobs=1)).errors
    yield scene, tmp_path / "out", tmp_path / "store"


def spoil(folder: Path, make: Callable[[Any], Any]) -> None:
    """Changes every sealed entry; the seals hold."""
    for path in (path for path in folder.rglob("*") if path.is_file()):
        tree, lines = unseal_lines(path.read_bytes())
        path.write_bytes(seal(make(tree), lines))


SOME = ["other kinds", "missing keys", "a path for a hash"]


@pytest.mark.deep
@pytest.mark.parametrize("kinds", [[*WRONG], SOME])
def test_entries_of_any_shape_change_no_bake(cove: tuple[Path, Path, Path], kinds: list[str]) -> None:
    scene, out, store = cove
    good = {path.name: path.read_bytes() for path in out.iterdir()}
    for what in kinds:
        make = WRONG[what]
        spoil(store / "products", make)
        spoil(store / "bakes", make)
        (out / "scene.json").unlink()
        report = bake(scene, out, BuildOptions(jobs=1))
        assert not report.errors, what
        assert {path.name: path.read_bytes() for path in out.iterdir()} == good, what


@pytest.mark.deep
def test_a_sealed_entry_of_deep_brackets_is_one_that_is_damaged(cove: tuple[Path, Path, Path]) -> None:
    import hashlib

    scene, out, store = cove
    entry = hashlib.sha256(DEEP).hexdigest().encode() + b"\n" + DEEP
    assert unseal(entry) is None
    for name in ("bakes", "products"):
        for path in (path for path in (store / name).rglob("*") if path.is_file()):
            path.write_bytes(entry)
    assert explain(scene, out=out).baked
    report = bake(scene, out, BuildOptions(jobs=1))
    assert not report.errors and report.count("baked") == len(report.rows)


def places(tree: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if above:
        yield above
    known = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in known:
        yield from places(value, (*above, key))


@pytest.mark.parametrize("count", sweep([25, 150], test=[25]))
def test_a_record_with_any_value_changed_is_refused_or_gives_a_report(
    cove: tuple[Path, Path, Path], count: int
) -> None:
    scene, out, root = cove
    store = Store(root)
    name = record_name(scene, out, None)
    record, lines = store.get_bake_lines(name)
    assert is_record(record)
    found = list(places(record))
    for place in found[:: max(1, len(found) // count)]:
        for value in (None, -1, "a\0b", [], {}, [[]], True):
            owner = record
            for key in place[:-1]:
                owner = owner[key]
            true_value, owner[place[-1]] = owner[place[-1]], value
            store.put_bake(name, record, lines)
            owner[place[-1]] = true_value
            report = unchanged_bake(store, name)
            if report is not None:
                json.dumps(report.as_json())


def test_a_record_gives_the_report_of_its_bake_and_parses_no_artifact_for_its_json(
    cove: tuple[Path, Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, out, root = cove
    store = Store(root)
    name = record_name(scene, out, None)
    last = unchanged_bake(store, name)
    assert last is not None and not last.told
    rows = list(last.artifacts)
    rows[1], rows[3] = replace(rows[1], over=["too coarse"]), replace(rows[3], also=["twin"])
    made = [replace(row, status="baked", seconds=2.0) for row in rows]
    provenance.remember(store, name, BakeReport(out, made, ["a warning"]), [scene], [], FileHashCache())
    report = unchanged_bake(store, name)
    assert report is not None and report.artifacts == rows and report.told == [rows[1], rows[3]]
    assert (report.count("reused"), report.count("baked")) == (len(rows), 0)
    told = json_text(report.as_json())
    again = unchanged_bake(store, name)
    monkeypatch.setattr(json, "loads", None)
    assert again is not None and json_text(again.as_json(again.texts)) == told


def test_a_record_without_one_of_its_lines_or_of_another_installation_counts_as_missing(
    cove: tuple[Path, Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, out, root = cove
    store = Store(root)
    name = record_name(scene, out, None)
    record, lines = store.get_bake_lines(name)
    assert unchanged_bake(store, name) is not None
    store.put_bake(name, record, lines[1:])
    assert unchanged_bake(store, name) is None
    store.put_bake(name, record, lines)
    path = root / "bakes" / name
    data = path.read_bytes()
    path.write_bytes(data[:-9] + b"?" + data[-8:])
    assert unchanged_bake(store, name) is None
    path.write_bytes(data)
    assert unchanged_bake(store, name) is not None
    monkeypatch.setattr(provenance, "__file__", "/elsewhere/paradize/build/provenance.py")
    assert unchanged_bake(store, record_name(scene, out, None)) is None
