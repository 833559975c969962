"""Whatever a file says: one message, in time and memory of the size of the file."""

from __future__ import annotations

import json
import resource
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.errors import ParadizeError, SourceError
from paradize.kinds import MODEL, refusal
from paradize.readers.model import read_model
from tests.pipeline.readers.gltf.made import Made, shown, square
from tests.sweeps import sweep, tries


def broken(change: Any) -> Made:
    made, primitive = square(NORMAL=np.tile(np.float32([0, 0, 1]), (4, 1)))
    shown(primitive, made)
    change(made.tree)
    return made


def put(path: str, value: Any) -> Any:
    """A change of a document: the value at a path of keys, or the key deleted where it is None."""

    def change(tree: Any) -> None:
        *above, last = [int(key) if key.isdigit() else key for key in path.split("/")]
        for key in above:
            tree = tree[key]
        if value is None:
            del tree[last]
        else:
            tree[last] = value

    return change


@pytest.mark.parametrize(
    ("count", "component", "words"),
    [
        (2, 5121, "/accessors/0/sparse/indices: .*index 4 of 4 values"),
        (5, 5121, "/accessors/0/sparse/count: .*5 of 4 values"),
        (2, 5120, "/accessors/0/sparse/indices/componentType: .*5120, expected one of"),
    ],
)
def test_sparse_values_of_no_place_are_refused(
    count: int, component: int, words: str, tmp_path: Path
) -> None:
    made, primitive = square()
    sparse = {
        "count": count,
        "indices": {"bufferView": made.view(bytes([0, 1, 2, 3, 4][-count:])), "componentType": component},
        "values": {"bufferView": made.view(bytes(12 * count))},
    }
    made.tree["accessors"][primitive["attributes"]["POSITION"]]["sparse"] = sparse
    with pytest.raises(SourceError, match=words):
        read_model(shown(primitive, made).glb(tmp_path / "a.glb"))


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("asset/version", "1.0", "glTF 1.0, expected 2.0"),
        ("asset/version", 1, "glTF 1, expected 2.0; export it as glTF 2.0"),
        ("asset/version", True, "glTF True, expected 2.0"),
        ("asset", None, "asset is missing"),
        ("asset/minVersion", "2.1", "needs glTF 2.1, expected 2.0"),
        ("accessors/0/count", 1 << 40, "/accessors/0: .* values end at byte"),
        ("accessors/0/count", 3, "values for 3 positions"),
        ("accessors/0/bufferView", 99, "99; there are 3 bufferViews"),
        ("accessors/0/byteOffset", -4, "-4, expected at least 0"),
        ("accessors/0/type", "VEC7", "'VEC7', not allowed"),
        ("accessors/0/componentType", 5130, "5130, not allowed"),
        ("accessors/2/componentType", 5126, "5126, not allowed"),
        ("bufferViews/0/byteLength", 1 << 40, "of a buffer of"),
        ("bufferViews/0/byteStride", 4, "a stride of 4 bytes for values of 12"),
        ("bufferViews/0/buffer", True, "True, expected a whole number"),
        ("meshes/0/primitives", {}, "expected a list"),
        ("meshes/0/primitives/0/mode", 7, "7, expected 0 to 6"),
        ("meshes/0/primitives/0/attributes/POSITION", -1, "-1; there are 3 accessors"),
        ("meshes/0/primitives/0/material", 0, "0; there are 0 materials"),
        ("nodes/0/children", [0], "the node hangs on itself"),
        ("nodes", [{"mesh": 0}, {"children": [0]}, {"children": [0]}], "node 0 hangs on node 1 already"),
        ("nodes/0", "post", "/nodes/0: not an object"),
        ("nodes/0/matrix", [1, 0, 0, 1], "expected 16 numbers"),
        ("nodes/0/mesh", 5, "5; there are 1 meshes"),
        ("nodes/0/matrix", [1] * 16, "last row"),
        ("nodes/0/rotation", [0, 0, 0, 1e200], "a rotation of 0 0 0 1e\\+200 is none"),
        ("nodes/0/scale", [1e300, 1, 1], "beyond float32"),
        ("nodes/0/skin", 0, "0; there are 0 skins"),
        ("scenes/0/nodes", [3], "3; there are 1 nodes"),
        ("scene", 2, "2; there are 1 scenes"),
        ("scene", "first", "'first', expected a whole number"),
    ],
)
def test_each_fault_is_named_with_its_place(path: str, value: Any, words: str, tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=words) as caught:
        read_model(broken(put(path, value)).glb(tmp_path / "a.glb"))
    assert str(tmp_path / "a.glb") in str(caught.value) and len(str(caught.value)) < 500


@pytest.mark.parametrize(
    ("text", "kind"),
    [("[1]", "a list"), ("[\n[2]\n]", "a list"), ("5", "a number"), ('"a"', "a text"), ("null", "null")],
)
def test_json_of_another_kind_is_named_and_not_taken_for_a_scene(
    text: str, kind: str, tmp_path: Path
) -> None:
    (tmp_path / "a.gltf").write_text(text)
    with pytest.raises(SourceError) as caught:
        read_model(tmp_path / "a.gltf")
    assert f'holds {kind}; a glTF file holds an object, {{"asset": ...}}; export' in str(caught.value)
    assert refusal(MODEL, tmp_path / "a.gltf") is None


def test_a_sound_model_is_not_refused(tmp_path: Path) -> None:
    assert not read_model(broken(lambda tree: None).glb(tmp_path / "a.glb")).warnings


def test_whole_numbers_may_be_written_with_a_point(tmp_path: Path) -> None:
    assert not read_model(broken(put("scenes/0/nodes", [0.0])).glb(tmp_path / "a.glb")).warnings
    for wrong in (0.5, 1e300, True):
        with pytest.raises(SourceError, match="expected whole numbers"):
            read_model(broken(put("scenes/0/nodes", [wrong])).glb(tmp_path / "a.glb"))


@pytest.mark.parametrize("version", [2, 2.0, 2.1])
def test_a_version_that_is_written_as_a_number_is_read_and_told(version: float, tmp_path: Path) -> None:
    (said,) = read_model(broken(put("asset/version", version)).glb(tmp_path / "a.glb")).warnings
    assert said.endswith(f"/asset/version: {version}, expected a text; read as one")


def test_indices_and_numbers_out_of_range_are_refused(tmp_path: Path) -> None:
    made, primitive = square()
    primitive["indices"] = made.array(np.array([0, 1, 65535], np.uint16))
    with pytest.raises(SourceError, match="index 65535 of 4 vertices"):
        read_model(shown(primitive, made).glb(tmp_path / "a.glb"))
    made = Made()
    primitive = {"attributes": {"POSITION": made.array(np.full((3, 3), np.nan, np.float32))}}
    with pytest.raises(SourceError, match="vertex 0 lies at nan nan nan"):
        read_model(shown(primitive, made).glb(tmp_path / "a.glb"))


def test_a_file_beside_that_is_missing_outside_or_short_is_named(tmp_path: Path) -> None:
    for uri, words in (
        ("none.bin", "none.bin: cannot be read: No such file"),
        ("../../up.bin", "'../../up.bin' is not a file inside"),
        ("/dev/zero", "'/dev/zero' is not a file inside"),
        ("https://a.b/c.bin", "is not a file inside"),
        ("short.bin", "bytes are said, 3 are there"),
        ("data:;base64,#", "is not base64"),
        ("data:nothing", "without a comma"),
    ):
        (tmp_path / "short.bin").write_bytes(b"123")
        with pytest.raises(SourceError, match=words):
            read_model(broken(lambda tree: None).gltf(tmp_path / "a.gltf", uri))


def test_a_container_that_is_cut_or_of_another_kind_says_so(tmp_path: Path) -> None:
    whole = broken(lambda tree: None).glb(tmp_path / "a.glb").read_bytes()
    wrong = [whole[:size] for size in (4, 11, 19, 60, len(whole) - 1)]
    wrong += [b"glTF" + struct.pack("<I", 1) + whole[8:], whole[:16] + b"BIN\0" + whole[20:]]
    wrong += [
        bytes(range(256)) * 20,
        b"",
        b"{",
        b"[]",
        b"\xff" * 99,
        b"f 1 2 3\n" + bytes(99),
        b"PK\3\4" * 50,
    ]
    for data in wrong:
        (tmp_path / "b.glb").write_bytes(data)
        with pytest.raises(SourceError) as caught:
            read_model(tmp_path / "b.glb")
        text = str(caught.value)
        assert "\n" not in text and len(text) < 600 and text.isprintable(), text


def limited() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
    resource.setrlimit(resource.RLIMIT_CPU, (60, 60))


def many_zeros(made: Made) -> None:
    zeros = made.add("accessors", componentType=5126, count=(1 << 31) - 1, type="VEC3")
    shown({"attributes": {"POSITION": zeros}}, made)


def many_instances(made: Made) -> None:
    count = 100_000
    view = made.view(np.zeros((count, 3), np.float32).tobytes())
    position = made.add("accessors", bufferView=view, componentType=5126, count=count, type="VEC3")
    mesh = made.mesh({"attributes": {"POSITION": position}})
    made.show(*(made.add("nodes", mesh=mesh) for _ in range(2000)))


def long_chain(made: Made) -> None:
    for k in range(200_000):
        made.add("nodes", children=[k + 1], scale=[3, 3, 3])
    made.add("nodes", mesh=made.mesh({"attributes": {"POSITION": made.array(np.eye(3, dtype=np.float32))}}))
    made.show(0)


@pytest.mark.parametrize(
    "bomb", sweep([many_zeros, many_instances, long_chain], test=[many_zeros, many_instances])
)
def test_a_file_that_unfolds_without_end_is_refused_in_bounded_time_and_memory(
    bomb: Any, tmp_path: Path
) -> None:
    made = Made()
    bomb(made)
    path = made.glb(tmp_path / "a.glb")
    code = (
        "import sys\nfrom pathlib import Path\nfrom paradize.errors import SourceError\n"
        "from paradize.readers.model import read_model\n"
        "try:\n    read_model(Path(sys.argv[1]))\nexcept SourceError as error:\n    print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, path], capture_output=True, text=True, preexec_fn=limited, timeout=900
    )
    assert done.returncode == 0 and not done.stderr, done.stderr[-2000:]
    assert str(path) in done.stdout and done.stdout.count("\n") == 1


@settings(max_examples=tries(60), deadline=None)
@given(data=st.data())
def test_any_change_of_the_text_is_read_or_refused(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    made = broken(lambda tree: None)
    text = json.dumps(made.tree)
    leaves = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=3), st.just([]))
    paths: list[list[Any]] = []

    def walk(part: Any, trail: list[Any]) -> None:
        members = (
            part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else ()
        )
        for key, value in members:
            paths.append([*trail, key])
            walk(value, [*trail, key])

    walk(json.loads(text), [])
    for _ in range(data.draw(st.integers(1, 3))):
        trail = data.draw(st.sampled_from(paths))
        part = made.tree
        try:
            for key in trail[:-1]:
                part = part[key]
            part[trail[-1]] = data.draw(leaves)
        except (TypeError, KeyError, IndexError):
            continue
    path = tmp_path_factory.mktemp("changed") / "a.glb"
    try:
        read_model(made.glb(path))
    except ParadizeError as error:
        assert str(path) in str(error)
