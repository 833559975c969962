"""JSON and TOML of others are read in time that grows with their bytes, or refused with place and limit."""

from __future__ import annotations

import contextlib
import gc
import json
import sys
import tomllib
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.documents import DEPTH, KEY_PARTS, TOML_BYTES, json_text, parse_json, parse_toml
from paradize.errors import FormatError, GroupedError, SceneError
from paradize.scene.schema import MOST_FAULTS, table_fields
from paradize.scene.settings import load_scene
from tests.pipeline.scenes import make_cove
from tests.sweeps import tries

WRONG_JSON = {
    b'{"a": [1, {"b": NaN}]}': "NaN is not a JSON number",
    b"[Infinity]": "Infinity is not a JSON number",
    b'{"a": {"b": [0, 1e400]}}': "f: a.b[1]: a number beyond the largest float64",
    b"[-1e999]": "f: [0]: a number beyond the largest float64",
    b'{"error_max": 1' + b"0" * 400 + b"}": "f: error_max: a whole number of 1329 bits, limit 64",
    b"[" + b"9" * 5000 + b"]": "a whole number of more than 4300 digits",
    b"[" * 100_000 + b"]" * 100_000: "nested too deeply: more than 64 levels",
    b"[" * 100_000: "nested too deeply: more than 64 levels",
    b'{"a":' * 65 + b"1" + b"}" * 65: "nested too deeply: more than 64 levels",
    b'{"a": 1, "b": 2, "a": 3}': "holds the key 'a' twice",
    b'{"a": "\\ud800"}': "f: a: not valid Unicode",
    b'{"\\udfff": 1}': "a key is not valid Unicode",
    b"\xff": "f: byte 0: is not UTF-8",
    b'{"a": 1,\n2}': "f: line 2, column 1: is not JSON",
    b"": "f: line 1, column 1: is not JSON",
}


@pytest.mark.parametrize("data", WRONG_JSON, ids=lambda data: ascii(data[:30]))
def test_json_that_could_overflow_what_reads_it_is_refused_with_its_place(data: bytes) -> None:
    with pytest.raises(FormatError) as caught:
        parse_json(data, "f")
    assert WRONG_JSON[data] in str(caught.value)


def test_json_beyond_its_bytes_is_refused_unparsed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("paradize.documents.json.loads", lambda *_, **__: pytest.fail("was parsed"))
    with pytest.raises(FormatError, match="5 bytes of JSON, limit 4"):
        parse_json(b"12345", "f", limit=4)


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-(1 << 63), (1 << 63) - 1) | st.text()
    | st.floats(allow_nan=False, allow_infinity=False),
    lambda below: st.lists(below, max_size=4) | st.dictionaries(st.text(), below, max_size=4),
    max_leaves=10,
)  # fmt: skip


FEWER = settings(max_examples=tries(120))  # of trees, which take long


@FEWER
@given(PLAIN)
def test_plain_json_is_what_pythons_reader_says(tree: Any) -> None:
    data = json.dumps(tree).encode()
    assert parse_json(data) == json.loads(data)


def test_the_deepest_json_and_the_largest_numbers_are_read() -> None:
    deepest = b"[" * DEPTH + b"]" * DEPTH
    assert parse_json(deepest) == json.loads(deepest)
    assert parse_json(b"[9223372036854775807, -9223372036854775808, 1.7976931348623157e308]")


FEW = ".".join("a" * KEY_PARTS)
MANY = f"{FEW}.b"
LONG_KEYS = [
    f"{MANY} = 1", f"[{MANY}]", f"[[{MANY}]]", f"x = {{ {MANY} = 1 }}", MANY.replace(".", " \t. "),
    "a." + '"b.c".' * KEY_PARTS + "d = 1", "a." + "'b'." * KEY_PARTS + "d = 1",
    ".".join("a" * 100_000) + " = 1",
    f'a = """\n"{MANY}"\n"""\n{MANY} = 1', f"a = 'x' # '\n{MANY} = 1", f'a = "\\"#"\n{MANY} = 1',
]  # fmt: skip
FINE = [
    f"{FEW} = 1", f"[{FEW}]\nb = 2", f"[[{FEW}]]", f'a = "{MANY}"', f"a = '{MANY}'", f"# {MANY}",
    f'a = """{MANY}"""', f"a = \'\'\'{MANY}\'\'\'", f'a = """""{MANY}"""""', f"a = 1 # {MANY}",
    f'a = "\\"{MANY}"', f'a = """\\"""{MANY}"""', f'"{MANY}" = 1', "a = [" + "1.5, " * 40 + "]",
    "a = 1979-05-27T07:32:00.999999Z", f"a = ''\nb = '{MANY}'",
]  # fmt: skip


@pytest.mark.parametrize("text", LONG_KEYS, ids=lambda text: text[:30])
def test_a_key_of_many_parts_is_refused_before_it_is_parsed(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A parser's work grows with the square of the parts: 100,000 took minutes."""
    monkeypatch.setattr("tomllib.loads", lambda *_: pytest.fail("was parsed"))
    line = text[: text.index("a.a.a")].count("\n") + 1 if "a.a.a" in text and "\n" not in text else None
    place = f"line {line}: " if line else ""
    with pytest.raises(FormatError, match=f"{place}a key has more than {KEY_PARTS} parts"):
        parse_toml(text.encode(), "f")


def test_the_line_of_a_long_key_is_told() -> None:
    text = f'a = 1\nb = """\n\n"""\n{MANY} = 1\n'
    with pytest.raises(FormatError, match="f: line 5: a key has more"):
        parse_toml(text.encode(), "f")


@pytest.mark.parametrize("text", FINE, ids=lambda text: text[:30])
def test_dots_that_are_in_no_key_are_no_parts_of_one(text: str) -> None:
    assert parse_toml(text.encode(), "f") == tomllib.loads(text)


@FEWER
@given(st.dictionaries(st.text(), PLAIN, max_size=4))
def test_what_is_written_for_people_is_read_again(tree: dict[str, Any]) -> None:
    assert parse_json(json_text(tree).encode()) == tree


def test_json_for_people_has_a_line_for_each_entry_and_none_for_each_number() -> None:
    rows = [{"name": "a", "levels": [1.0, 2.0]}, {"name": "b", "levels": []}]
    text = json_text({"rows": rows, "none": [], "baked": 2, "at": [0.5, 1]})
    assert [line.strip(" ,") for line in text.splitlines()] == [
        "{", '"rows": [', *map(json.dumps, rows), "]", '"none": []', '"baked": 2', '"at": [0.5, 1]', "}",
    ]  # fmt: skip
    with pytest.raises(ValueError, match="JSON compliant"):
        json_text({"a": float("nan")})


@given(st.text(alphabet="a.\"'#\\\n =[]{},1", max_size=60))
def test_toml_of_short_keys_is_what_pythons_reader_says(text: str) -> None:
    try:
        known: Any = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        known = None
    try:
        found: Any = parse_toml(text.encode(), "f")
    except FormatError as error:
        found = None
        assert known is None or "parts" in str(error)
    assert found == known or found is None


FAMILIES: dict[str, Callable[[int], str]] = {
    "keys": lambda n: "".join(f"k{i} = 1\n" for i in range(n)),
    "tables": lambda n: "".join(f"[{FEW[:-2]}.t{i}]\nx = 1\n" for i in range(n)),
    "keys in a deep table": lambda n: f"[{FEW}]\n" + "".join(f"k{i} = 1\n" for i in range(n)),
    "deep keys": lambda n: "".join(f"{FEW[:-2]}.k{i} = 1\n" for i in range(n)),
    "arrays of tables": lambda n: "[[a]]\n[[a.b]]\nx = 1\n" * n,
    "inline": lambda n: "a = {" + ", ".join(f"k{i} = [1]" for i in range(n)) + "}",
    "escapes": lambda n: 'a = "' + "\\n" * n + '"',
    "quotes": lambda n: 'a = """' + '""x' * n + '"""',
    "comments": lambda n: "# x\n" * n,
}


def calls_of(call: Callable[[], object]) -> int:
    """How many functions are called, in Python and in C."""
    count = 0

    def hook(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(hook)
    try:
        call()
    finally:
        sys.setprofile(None)
    return count


@pytest.mark.parametrize("family", FAMILIES)
def test_toml_that_is_twice_as_long_is_at_most_twice_the_work(family: str) -> None:
    one, two = (FAMILIES[family](n).encode() for n in (500, 1000))
    few, many = (calls_of(lambda data=data: parse_toml(data, "f")) for data in (one, two))
    assert many <= 2.1 * few


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("a = 0x" + "f" * 5000, "f: a: a whole number of 20000 bits, limit 64"),
        ("a = " + "1" * 5000, "a whole number of more than 4300 digits"),
        ("a = " + "[" * 65 + "]" * 65, "nested too deeply: more than 64 levels"),
        ("a = " + "[" * 100_000, "nested too deeply: more than 64 levels"),
        ("a = " + "{a = " * 100_000, "nested too deeply: more than 64 levels"),
        ("\ud800", "is not UTF-8"),
        ("a = 1 " * (TOML_BYTES // 6 + 1), f"limit {TOML_BYTES}"),
    ],
    ids=lambda value: value[:20],
)
def test_toml_beyond_a_limit_is_refused_in_words(text: str, what: str) -> None:
    with pytest.raises(FormatError, match=what):
        parse_toml(text.encode(errors="surrogatepass"), "f")


def scene_with(folder: Path, more: str) -> Path:
    path = make_cove(folder)
    path.write_text(path.read_text() + more)
    return path


def test_too_many_objects_are_refused_by_their_count_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """None of them is worth a look: of 45,000 it took a minute."""
    read_places = []
    real = table_fields.read_table
    monkeypatch.setattr(
        table_fields, "read_table", lambda *given: read_places.append(given[2]) or real(*given)
    )
    path = scene_with(tmp_path, '[[object]]\nname = "a"\nmesh = "post.obj"\n' * 15_000)
    with pytest.raises(SceneError, match="object: has 15001 entries; allowed: 0 to 10000"):
        load_scene(path)
    assert len(read_places) < 100


def test_after_a_hundred_faults_the_rest_is_not_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    guessed = []
    real = table_fields.nearest
    monkeypatch.setattr(table_fields, "nearest", lambda *given: guessed.append(given) or real(*given))
    path = scene_with(tmp_path, "[fogg]\n" + "".join(f"[unknown{i}]\n" for i in range(20_000)))
    with pytest.raises(GroupedError) as caught:
        load_scene(path)
    assert len(caught.value.errors) == MOST_FAULTS + 1 == len(guessed) + 1
    assert "more than 100 faults: the rest is not looked at" in str(caught.value)


def test_the_place_of_a_fault_costs_no_more_than_the_document() -> None:
    """A key of a million letters above many numbers, the last of which is too large."""
    text = '{"' + "k" * 1_000_000 + '": [' + "1," * 20_000 + "9223372036854775808]}"
    tracemalloc.start()
    try:
        with pytest.raises(FormatError, match="64 bits"):
            parse_json(text.encode())
        assert tracemalloc.get_traced_memory()[1] < 64 << 20
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("text", ["[1, 2]", '{"a": [{"b": 1e999}]}', "a = 9223372036854775808"])
def test_the_garbage_collector_is_as_before(text: str) -> None:
    for before in (True, False):
        (gc.enable if before else gc.disable)()
        try:
            with contextlib.suppress(FormatError):
                (parse_toml(text.encode(), "a.toml") if "=" in text else parse_json(text.encode()))
            assert gc.isenabled() is before
        finally:
            gc.enable()
