"""STL arrives whole, binary and text, or is refused in one line."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.mesh.bake import bake_mesh
from paradize.errors import SourceError
from paradize.readers.model import read_model

BOX = trimesh.creation.box()


@pytest.mark.parametrize("form", ["stl", "stl_ascii"])
def test_an_stl_is_read_and_baked_with_its_corners_joined(form: str, tmp_path: Path) -> None:
    data = BOX.export(file_type=form)
    (tmp_path / "a.STL").write_bytes(data if isinstance(data, bytes) else data.encode())
    model = read_model(tmp_path / "a.STL")
    assert len(model.mesh.positions) == 8 and model.counts["triangles"] == 12
    assert np.array_equal(model.mesh.positions[model.mesh.triangles], BOX.triangles.astype(np.float32))
    report = bake_mesh(tmp_path / "a.STL", lods=1).report
    assert report["closed"] and report["vertices"] == 24, "edges of a box are sharp"


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), facets=st.integers(1, 40))
def test_any_facets_are_read_back_equal(
    seed: int, facets: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    corners = np.random.default_rng(seed).normal(size=(facets, 3, 3)).astype(np.float32)
    path = tmp_path_factory.mktemp("stl") / "a.stl"
    rows = [struct.pack("<3f9fH", 0, 0, 0, *row.reshape(9), 0) for row in corners]
    path.write_bytes(b"solid in name".ljust(80) + struct.pack("<I", facets) + b"".join(rows))
    mesh = read_model(path).mesh
    assert np.array_equal(mesh.positions[mesh.triangles], corners)


def test_a_broken_stl_is_refused_in_one_line(tmp_path: Path) -> None:
    whole = BOX.export(file_type="stl")
    infinite = whole[:96] + struct.pack("<f", np.inf) + whole[100:]
    for data, words in (
        (whole[:-1], "cut: 683 bytes; its 12 facets need 684"),
        (whole[:80] + b"\xff" * 4 + whole[84:], "cut: 684 bytes; its 4294967295 facets"),
        (bytes(84), "holds no facets"),
        (b"solid a\nendsolid a\n", "holds no facets"),
        (b"solid a\nvertex 1 2 3\n", "1 corners are not whole facets"),
        (b"solid a\n" + b"vertex 1 2 x\n" * 3, "a corner that is not a number"),
        (infinite, "facet 0: a corner at inf"),
        (b"", "is an empty file"),
        (b"words", "is not an STL: a text that begins with b'words'"),
    ):
        (tmp_path / "a.stl").write_bytes(data)
        with pytest.raises(SourceError, match=words) as caught:
            read_model(tmp_path / "a.stl")
        assert "\n" not in str(caught.value)


def test_text_in_capital_letters_and_binary_that_calls_itself_solid_are_read(tmp_path: Path) -> None:
    text = BOX.export(file_type="stl_ascii")
    binary = BOX.export(file_type="stl")
    assert isinstance(text, str)
    for data in (
        text.upper().encode(),
        b"\xef\xbb\xbf\r\n  " + text.encode(),
        b"solid box".ljust(80) + binary[80:] + b"a trailer",
    ):
        (tmp_path / "a.stl").write_bytes(data)
        model = read_model(tmp_path / "a.stl")
        assert model.counts["triangles"] == 12 and not model.warnings


def test_text_that_ends_between_two_facets_is_told(tmp_path: Path) -> None:
    text = BOX.export(file_type="stl_ascii")
    assert isinstance(text, str)
    (tmp_path / "a.stl").write_text(text[: text.index("endfacet", len(text) // 2)])
    assert read_model(tmp_path / "a.stl").warnings == [
        f"{tmp_path / 'a.stl'}: ends without endsolid: it may be cut; export the model again"
    ]
