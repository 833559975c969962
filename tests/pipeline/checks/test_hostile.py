"""`paradize check` of files of any shape ends in findings, never in an exception."""

from __future__ import annotations

import io
import json
import random
import shutil
import struct
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import soundfile

from paradize.bakers.mesh.bake import bake_mesh
from paradize.checks import Finding, check_paths, render
from paradize.checks.glb_arrays import read_levels
from paradize.checks.gutters import check_gutters
from paradize.checks.meshes import check_mesh
from paradize.checks.sounds import check_sound
from paradize.data import Texture
from paradize.errors import FormatError
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.reader import _read_key_values, decode_ktx2
from paradize.formats.png import encode_png
from tests.pipeline.bakes import bake_apart
from tests.pipeline.scenes import ball, make_cove
from tests.sweeps import CORPUS_DEEP, sweep

VALUES: list[Any] = [
    None, -1, 0, 2, 5, 5120, 5121, 5126, 1 << 40, 1 << 70, 1e300, float("inf"), float("nan"), True, "x",
    "SCALAR", "VEC2", "VEC4", [], {}, [0], {"a": 1},
]  # fmt: skip


@pytest.fixture(scope="module")
def glb(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("ball") / "ball.obj"
    path.write_text(ball(6))
    return bake_mesh(path, lods=2).glb


def places(tree: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if above:
        yield above
    for key, value in (
        tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    ):
        yield from places(value, (*above, key))


def packed(tree: Any, rest: bytes) -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    return head + struct.pack("<I4s", len(text), b"JSON") + text + rest


def look(data: bytes) -> int:
    """Both readers see it; the number of findings."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with suppress(FormatError):
            decode_glb(data, "a.glb")
        return len(list(check_mesh(data, "a.glb")))


@pytest.mark.deep
def test_a_json_chunk_of_any_shape_is_a_finding(glb: bytes) -> None:
    length = struct.unpack_from("<I", glb, 12)[0]
    tree, rest = json.loads(glb[20 : 20 + length]), glb[20 + length :]
    assert look(packed(tree, rest)) == 0
    for value in VALUES[:-4]:
        assert look(packed(value, rest)) == 1
    for place in places(tree):
        for value in VALUES:
            changed = json.loads(json.dumps(tree))
            owner = changed
            for key in place[:-1]:
                owner = owner[key]
            owner[place[-1]] = value
            look(packed(changed, rest))


def test_a_glb_with_any_bytes_changed_or_cut_is_no_crash(glb: bytes) -> None:
    chance = random.Random(5)
    for _ in range(500):
        data = bytearray(glb)
        for _ in range(chance.choice((1, 2, 5))):
            data[chance.randrange(len(data))] = chance.choice((0, 127, 255, chance.randrange(256)))
        look(bytes(data[: chance.choice((len(data), chance.randrange(len(data))))]))


@pytest.mark.parametrize(
    ("attribute", "accessor"), [("NORMAL", "TEXCOORD_0"), ("TANGENT", "NORMAL"), ("POSITION", "TANGENT")]
)
def test_an_attribute_of_another_width_is_named(glb: bytes, attribute: str, accessor: str) -> None:
    length = struct.unpack_from("<I", glb, 12)[0]
    tree = json.loads(glb[20 : 20 + length])
    attributes = tree["meshes"][0]["primitives"][0]["attributes"]
    attributes[attribute] = attributes[accessor]
    found = list(check_mesh(packed(tree, glb[20 + length :]), "a.glb"))
    assert found[0].code == "PZ102" and attribute in found[0].what


@pytest.mark.parametrize("kind", ["SCALAR", "VEC2", "VEC3", "VEC4"])
def test_an_accessor_of_another_type_is_a_finding(glb: bytes, kind: str) -> None:
    length = struct.unpack_from("<I", glb, 12)[0]
    tree = json.loads(glb[20 : 20 + length])
    for accessor in tree["accessors"]:
        if accessor["type"] != kind:
            was, accessor["type"] = accessor["type"], kind
            assert look(packed(tree, glb[20 + length :])) > 0, accessor
            accessor["type"] = was


def interleaved(length: int) -> bytes:
    """Vertices as other tools write them: rows of 32 bytes, indices in the middle of their view, colours as
    codes. length: of the first view."""
    rng = np.random.default_rng(2)
    rows = np.zeros(4, np.dtype([("p", "<f4", 3), ("pad", "<f4"), ("n", "<f4", 3), ("c", "u1", 4)]))
    rows["p"], rows["n"], rows["c"] = rng.random((4, 3)), rng.random((4, 3)), rng.integers(0, 256, (4, 4))
    indices = np.array([9, 9, 9, 0, 1, 2, 2, 1, 3], "<u2").tobytes()
    binary = bytes(8) + rows.tobytes() + indices + bytes(2)
    floats = {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}
    tree = {
        "asset": {"version": "2.0"},
        "nodes": [{"name": "thing", "mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2}, "indices": 3}]}
        ],
        "accessors": [
            floats,
            floats | {"byteOffset": 16},
            {"bufferView": 0, "byteOffset": 28, "componentType": 5121, "count": 4, "type": "VEC4"}
            | {"normalized": True},
            {"bufferView": 1, "byteOffset": 6, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 8, "byteLength": length, "byteStride": 32},
            {"buffer": 0, "byteOffset": 136, "byteLength": 18},
        ],
    }
    return packed(tree, struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def test_rows_with_strides_and_offsets_are_read_as_they_lie() -> None:
    (level,) = read_levels(interleaved(128), "a.glb")
    (primitive,) = level.primitives
    rng = np.random.default_rng(2)
    for name in ("POSITION", "NORMAL"):
        assert np.array_equal(primitive.attributes[name], rng.random((4, 3)).astype(np.float32))
    colors = rng.integers(0, 256, (4, 4)) / 255.0
    assert np.allclose(primitive.attributes["COLOR_0"], colors, atol=1e-7)
    assert primitive.indices is not None and primitive.indices.tolist() == [0, 1, 2, 2, 1, 3]
    with pytest.raises(FormatError, match="reaches beyond its buffer"):
        read_levels(interleaved(127), "a.glb")  # of the view, not of the file


def test_signed_indices_are_refused_before_they_reach_backwards(glb: bytes) -> None:
    length = struct.unpack_from("<I", glb, 12)[0]
    tree = json.loads(glb[20 : 20 + length])
    tree["accessors"][tree["meshes"][0]["primitives"][0]["indices"]]["componentType"] = 5122
    found = list(check_mesh(packed(tree, glb[20 + length :]), "a.glb"))
    assert found[0].code == "PZ102" and "indices" in found[0].what


def test_names_with_control_characters_leave_every_format_readable(tmp_path: Path) -> None:
    findings = check_paths([tmp_path / "a\nb\x1bc.glb"])
    assert len(render(findings, "text").splitlines()) == 2 and "\x1b" not in render(findings, "text")
    assert "PZ101" in ElementTree.fromstring(render(findings, "junit")).findtext(".//failure", "")
    for form in ("json", "sarif"):
        json.loads(render(findings, form))


def test_many_primitives_on_the_same_arrays_ask_for_no_more_work(glb: bytes) -> None:
    """A small file must not keep the checker busy for hours, nor fill the memory."""
    length = struct.unpack_from("<I", glb, 12)[0]
    tree, rest = json.loads(glb[20 : 20 + length]), glb[20 + length :]
    tree["meshes"][0]["primitives"] *= 20_000
    assert not list(check_mesh(packed(tree, rest), "a.glb"))
    with pytest.raises(FormatError, match="triangles of"):
        decode_glb(packed(tree, rest), "a.glb")
    tree = json.loads(glb[20 : 20 + length])
    primitive = tree["meshes"][0]["primitives"][0]
    normal = tree["accessors"][primitive["attributes"]["NORMAL"]]
    for _ in range(5_000):
        tree["accessors"].append(normal)
        more = {**primitive["attributes"], "NORMAL": len(tree["accessors"]) - 1}
        tree["meshes"][0]["primitives"].append({**primitive, "attributes": more})
    found = list(check_mesh(packed(tree, rest), "a.glb"))
    assert found[0].code == "PZ102" and "times over" in found[0].what


def test_a_fault_of_vertices_that_primitives_share_is_told_once(glb: bytes) -> None:
    length = struct.unpack_from("<I", glb, 12)[0]
    tree = json.loads(glb[20 : 20 + length])
    tree["meshes"][0]["primitives"] *= 3
    at = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]["bufferView"]
    rest = bytearray(glb[20 + length :])
    struct.pack_into("<f", rest, 8 + tree["bufferViews"][at]["byteOffset"], float("nan"))
    found = [finding for finding in check_mesh(packed(tree, bytes(rest)), "a.glb") if finding.code == "PZ202"]
    assert len(found) == 1 and found[0].count == 1


@CORPUS_DEEP
@pytest.mark.parametrize("every", sweep([1, 4], test=[4]))
def test_every_file_is_findings_or_none_in_every_form(sources: Path, every: int) -> None:
    files = [path for path in sorted(sources.rglob("*")) if path.is_file() and path.stat().st_size < 4 << 20]
    assert len(files) > 300
    files = files[::every]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for path in files:
            findings = check_paths([path])
            for form in ("text", "json", "junit", "sarif"):
                assert render(findings, form), path


@pytest.fixture(scope="module")
def cove(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> Path:
    top = tmp_path_factory.mktemp("cove")
    cove_store(top / "store")
    bake_apart(make_cove(top / "cove"), top)
    return top / "out"


def test_a_number_of_401_digits_hides_no_other_files_finding(glb: bytes, tmp_path: Path) -> None:
    length = struct.unpack_from("<I", glb, 12)[0]
    tree = json.loads(glb[20 : 20 + length])
    tree["nodes"][1]["extras"]["error_max"] = 10**400
    (tmp_path / "a.glb").write_bytes(packed(tree, glb[20 + length :]))
    (tmp_path / "b.ktx2").write_bytes(b"no texture")
    found = {Path(finding.file).name: finding for finding in check_paths([tmp_path])}
    assert found["a.glb"].code == found["b.ktx2"].code == "PZ102"
    assert "nodes[1].extras.error_max: a whole number of 1329 bits, limit 64" in found["a.glb"].what


def test_what_breaks_the_check_of_one_file_is_a_finding_and_the_rest_is_checked(
    glb: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(data: bytes, file: str) -> Iterator[Finding]:
        if file.endswith("b.glb"):
            yield Finding("PZ206", file, "found before it broke")
            raise ZeroDivisionError("of some kind")
        yield from check_mesh(data, file)

    for name in ("a.glb", "b.glb", "c.glb"):
        (tmp_path / name).write_bytes(glb if name != "c.glb" else glb[:-4])
    monkeypatch.setattr("paradize.checks.paths.check_mesh", broken)
    for paths in ([tmp_path], sorted(tmp_path.iterdir())):
        found = [(Path(finding.file).name, finding.code, finding.fails) for finding in check_paths(paths)]
        assert found == [("b.glb", "PZ206", False), ("b.glb", "PZ105", True), ("c.glb", "PZ102", True)]


@pytest.mark.parametrize(
    "search",
    [
        "_artifact",
        "check_budget",
        "check_layouts",
        "check_gutters",
        "scene_maps",
        "check_tiles",
        "_unused",
        "_path",
        "check_flight",
    ],
)
def test_a_search_that_breaks_in_a_scene_ends_no_other(
    search: str, cove: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> Iterator[Finding]:
        raise RecursionError("of some kind")
        yield

    ran = []
    searches = ["check_layouts", "check_gutters", "scene_maps", "check_tiles", "check_flight"]
    for name in searches:
        monkeypatch.setattr(f"paradize.checks.scenes.{name}", lambda *_, name=name: ran.append(name) or ())
    monkeypatch.setattr(f"paradize.checks.scenes.{search}", broken)
    found = check_paths([cove])
    assert {finding.code for finding in found} == {"PZ105"}
    assert ran == [name for name in searches if name != search]


def test_a_broken_map_leaves_the_gutters_of_the_others_checked(cove: Path, tmp_path: Path) -> None:
    shutil.copytree(cove, tmp_path / "out")
    manifest = json.loads((tmp_path / "out/scene.json").read_bytes())
    for name in ("post_color", "post_normal"):
        (tmp_path / "out" / manifest["artifacts"][name]["file"]).write_bytes(b"no texture")
    walked = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("paradize.checks.gutters._walk", lambda *_, key, **more: walked.append(key) or ())
        list(check_gutters(manifest, tmp_path / "out"))
    assert walked == ["height", "gloss"]


def test_metadata_of_many_keys_is_refused_before_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """80,000 keys took two minutes."""
    texture = Texture("R8_UNORM", 1, 1, (b"x",), 1)
    data = bytearray(encode_ktx2(texture))
    monkeypatch.setattr("paradize.formats.ktx2.reader._read_key_values", lambda *_: pytest.fail("was read"))
    struct.pack_into("<I", data, 60, 1 << 20)
    with pytest.raises(FormatError, match="1048576 bytes of metadata, limit 65536"):
        decode_ktx2(bytes(data) + bytes(1 << 20))


@pytest.mark.parametrize("keys", [100, 4000])
def test_metadata_in_order_is_read_and_a_key_out_of_order_is_told(keys: int) -> None:
    def entry(key: str) -> bytes:
        text = key.encode() + b"\0v\0"
        return struct.pack("<I", len(text)) + text + bytes(-len(text) % 4)

    known = [f"{k:05}" for k in range(keys)]
    data = b"".join(map(entry, known))
    assert list(_read_key_values(data, 0, len(data), "f")) == known
    data += entry(known[0])
    with pytest.raises(FormatError, match="metadata key '00000' is out of order"):
        _read_key_values(data, 0, len(data), "f")


def test_a_sound_that_decodes_to_hours_is_refused_undecoded(monkeypatch: pytest.MonkeyPatch) -> None:
    quiet = io.BytesIO()
    soundfile.write(quiet, np.zeros(8000, np.float32), 8000, format="OGG", subtype="VORBIS")
    monkeypatch.setattr("paradize.checks.sounds._MAX_S", 0.5)
    monkeypatch.setattr(soundfile.SoundFile, "read", lambda *_, **__: pytest.fail("was decoded"))
    (found,) = check_sound(quiet.getvalue(), "a.ogg")
    assert (found.code, found.what) == ("PZ102", "lasts 1 s, limit 0.5")


def test_a_picture_of_too_many_texels_is_refused_undecoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a_normal.png").write_bytes(encode_png(np.zeros((4, 4, 3), np.uint8)))
    monkeypatch.setattr("paradize.formats.png.MAX_VALUES", 47)
    (found,) = check_paths([tmp_path / "a_normal.png"])
    assert (found.code, found.what) == ("PZ102", "4 x 4 texels of 3 channels, limit 47 values")
