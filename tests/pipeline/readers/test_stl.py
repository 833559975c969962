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


CORNERS = ["0 0", "1 0", "1 1", "0 1", "-1 0.5"]


def loops(*counts: int) -> bytes:
    """A text of facets with so many corners, each one higher than that before."""
    facets = [
        "facet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {corner} {z}\n" for corner in CORNERS[:count])
        + "endloop\nendfacet\n"
        for z, count in enumerate(counts)
    ]
    return f"solid vertex endloop\n{''.join(facets)}endsolid\n".encode()


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
        (whole[:-3], "cut: 681 bytes; its 12 facets need 684"),
        (whole[:80] + b"\xff" * 4 + whole[84:], "cut: 684 bytes; its 4294967295 facets"),
        (bytes(84), "holds no facets"),
        (b"solid a\nendsolid a\n", "holds no facets"),
        (b"solid a\nvertex 1 2 3\n", "line 2: 1 corners without an endloop behind them"),
        (loops(3, 3).replace(b"endloop\nend", b"end", 1), "line 6: 3 corners without an endloop"),
        (loops(3) + loops(2), "line 15: a loop of 2 corners, expected 3 or more"),
        (loops(3, 3)[:-20], "line 13: 3 corners without an endloop behind them"),
        (loops(3).replace(b"1 0 0\n", b"1 0\n"), "line 5: a corner at '1 0 vertex', expected three numbers"),
        (loops(3).replace(b"1 0 0", b"1 0 x"), "line 5: a corner at '1 0 x', expected three numbers"),
        (loops(3).replace(b"1 0 0", b"1_0 0 0"), "line 5: a corner at '1_0 0 0', expected three numbers"),
        (loops(4, 3).replace(b"1 0 1", b"1 0 nan"), "facet 1: a corner at 1 0 nan"),
        (loops(4, 3).replace(b"vertex 0 0 1", b"vertex nan 0 1"), "facet 1: a corner at nan 0 1"),
        (infinite, "facet 0: a corner at inf"),
        (loops(3, 3)[:-20].replace(b"\n", b"\r"), "line 13: 3 corners without an endloop behind them"),
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
        text.encode() + bytes(20),
        b"solid box".ljust(80) + binary[80:] + b"a trailer",
        binary[:-1],  # as 3ds Max writes it
    ):
        (tmp_path / "a.stl").write_bytes(data)
        model = read_model(tmp_path / "a.stl")
        assert model.counts["triangles"] == 12 and not model.warnings


def test_corners_at_zero_of_either_sign_are_one_vertex(tmp_path: Path) -> None:
    text = loops(3).replace(b"vertex 0 0 0", b"vertex -0.0 0 -0") + loops(3)
    (tmp_path / "a.stl").write_bytes(text)
    positions = read_model(tmp_path / "a.stl").mesh.positions
    assert len(positions) == 3 and not np.signbit(positions).any()


@pytest.mark.parametrize("before", [b"", loops(*[3] * 50)])
def test_text_that_ends_between_two_facets_is_told(before: bytes, tmp_path: Path) -> None:
    text = BOX.export(file_type="stl_ascii")
    assert isinstance(text, str)
    cut = text[: text.index("endfacet", len(text) // 2)] + " " * 4096 * bool(before)
    (tmp_path / "a.stl").write_bytes(before + cut.encode())
    assert read_model(tmp_path / "a.stl").warnings == [
        f"{tmp_path / 'a.stl'}: ends without endsolid: it may be cut; export the model again"
    ]


def test_facets_of_a_text_with_more_corners_are_cut_and_told_and_no_triangle_joins_two(
    tmp_path: Path,
) -> None:
    (tmp_path / "a.stl").write_bytes(loops(4, 5, 3, 4) + loops(4).replace(b"\n", b" "))
    model = read_model(tmp_path / "a.stl")
    heights = model.mesh.positions[model.mesh.triangles][:, :, 2]
    assert heights.tolist() == [[z] * 3 for z in (0, 0, 1, 1, 1, 2, 3, 3, 0, 0)]
    assert model.counts["faces"] == 5 and model.counts["triangles"] == 10
    a, b, c = (model.mesh.positions[model.mesh.triangles[:, k], :2] for k in range(3))
    area = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert (area > 0).all() and area.sum() == 1 + 1.5 + 0.5 + 1 + 1
    (told,) = model.warnings
    assert told.endswith("a.stl: 4 facets with more than three corners; cut into triangles")


def test_facets_behind_those_that_a_binary_header_counts_are_told(tmp_path: Path) -> None:
    whole = BOX.export(file_type="stl")
    (tmp_path / "a.stl").write_bytes(whole[:80] + struct.pack("<I", 9) + whole[84:])
    model = read_model(tmp_path / "a.stl")
    assert model.counts["triangles"] == 9
    (told,) = model.warnings
    assert "holds bytes of 3 facets behind the 9 that its header says; these are left out" in told


RED, BLUE, WHITE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)
HALF = 0.21586  # linear light of the code 128


@pytest.mark.parametrize(
    ("header", "bits", "colors"),
    [
        (b"COLOR=\x80\x80\x80\xff", (31, 31 << 10, 1 << 15), (RED, BLUE, (HALF,) * 3)),  # as Magics
        (b"made by hand", (1 << 15 | 31 << 10, 1 << 15 | 31, 31), (RED, BLUE, WHITE)),  # as VisCAM
        (b"COLOR=\x7f\x7f\x7f MATERIAL=", (0, 0, 0), None),  # of facets without colours
        (b"made by hand", (0x2020,) * 3, None),  # a filling, as of Blender 2.4
        (b"made by hand", (0xFFFF,) * 3, None),  # as of Meshmixer
        (b"made by hand", (1, 2, 3), None),  # numbers of facets
    ],
)
def test_the_colors_of_facets_are_read_as_the_programs_that_write_them_mean(
    header: bytes, bits: tuple[int, ...], colors: tuple[tuple[float, ...], ...] | None, tmp_path: Path
) -> None:
    rows = [
        struct.pack("<3f9fH", 0, 0, 0, 0, 0, k, 1, 0, 0, 0, 1, 0, own) for k, own in enumerate(bits)
    ]  # all share an edge
    (tmp_path / "a.stl").write_bytes(header.ljust(80) + struct.pack("<I", len(rows)) + b"".join(rows))
    model = read_model(tmp_path / "a.stl")
    assert not model.warnings
    if colors is None:
        assert model.mesh.colors is None and len(model.mesh.positions) == 5
        return
    assert model.mesh.colors is not None and len(model.mesh.positions) == 9
    found = model.mesh.colors[model.mesh.triangles]
    assert np.allclose(found[..., :3], np.array(colors)[:, None], atol=1e-4) and (found[..., 3] == 1.0).all()
