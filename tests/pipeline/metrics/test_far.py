"""The error of loading a model, near and far from the origin: held to the text in fractions and float64."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial import cKDTree

from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.quantise import quantised_levels
from paradize.build.measurements.nearest_view import sample_points
from paradize.checks.meshes import check_mesh
from paradize.data import Lod
from paradize.errors import FormatError, SourceError
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.reader import decode_glb
from paradize.kernels.reference import loading
from paradize.readers.obj import read_obj
from tests.pipeline.glb_json import document, with_document
from tests.pipeline.shapes import sphere
from tests.sweeps import sample

F64 = npt.NDArray[np.float64]
FAR = {
    "1e5": (1e5, 0.0, 0.0),
    "1e6": (1e6, 0.0, -1e6),
    "1e7": (-1e7, 1e7, 1e7),
    "a map's grid": (499_980.3, 431.7, 5_234_567.1),
}
SIDE = 40  # quads


def hills(shift: Sequence[float] = (0, 0, 0), size: float = 1.0) -> F64:
    """A square of `size` metres with hills, 1,681 places."""
    z, x = np.meshgrid(np.arange(SIDE + 1) / SIDE, np.arange(SIDE + 1) / SIDE, indexing="ij")
    y = 0.1 * np.sin(7 * x) * np.cos(5 * z)
    return np.asarray(size * np.stack([x, y, z], -1).reshape(-1, 3) + np.array(shift, np.float64))


def write(path: Path, places: F64, more: str = "") -> Path:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in places.tolist()]
    lines += [
        f"vt {i % (SIDE + 1) / SIDE:.6f} {1 - i // (SIDE + 1) / SIDE:.6f}" for i in range((SIDE + 1) ** 2)
    ]
    for row in range(SIDE):
        for a in range(row * (SIDE + 1) + 1, row * (SIDE + 1) + SIDE + 1):
            b, c, d = a + 1, a + SIDE + 1, a + SIDE + 2
            lines += [f"f {i}/{i} {j}/{j} {k}/{k}" for i, j, k in ((a, c, b), (b, c, d))]
    path.write_text("\n".join(lines) + "\n" + more)
    return path


def placed(glb: bytes, node: int = 0) -> F64:
    """Where glTF puts a node's vertices, in float64, read by nothing of ours."""
    tree = document(glb)
    stand = tree["nodes"][node]
    accessor = tree["accessors"][tree["meshes"][stand["mesh"]]["primitives"][0]["attributes"]["POSITION"]]
    view = tree["bufferViews"][accessor["bufferView"]]
    (length,) = struct.unpack_from("<I", glb, 12)
    kind = {5126: np.dtype("<f4"), 5123: np.dtype("<u2")}[accessor["componentType"]]
    stride = view.get("byteStride", 3 * kind.itemsize)
    rows = np.ndarray(
        (accessor["count"], 3), kind, glb, 28 + length + view["byteOffset"], (stride, kind.itemsize)
    ).astype(np.float64)
    scale, translation = stand.get("scale", [1.0] * 3), stand.get("translation", [0.0] * 3)
    return np.asarray(rows * scale + translation)


def farthest(found: F64, truth: F64) -> float:
    """The largest way from a place of either set to the nearest of the other."""
    middle = truth.mean(axis=0)
    a, b = found - middle, truth - middle
    return float(max(cKDTree(a).query(b)[0].max(), cKDTree(b).query(a)[0].max()))


@pytest.mark.parametrize("quantise", [None, {}], ids=["floats", "codes"])
@pytest.mark.parametrize(("shift",), sample([(shift,) for shift in FAR.values()], every=9), ids=FAR)
def test_a_model_far_away_keeps_its_places_and_is_measured_from_its_text(
    tmp_path: Path, shift: tuple[float, float, float], quantise: dict[str, float] | None
) -> None:
    truth = hills(shift)
    made = bake_mesh(write(tmp_path / "a.obj", truth), lods=3, quantise=quantise)
    report = made.report
    assert report["triangles"] == 2 * SIDE * SIDE and report["warnings"] == []
    across = float(np.linalg.norm(np.ptp(truth, axis=0)))
    lost = report["loading"]["load_max_m"]
    assert 0 < lost <= 1e-6 * across
    finest = report["lods"][0]
    assert finest["load_max"] == pytest.approx(lost / across, rel=1e-5)
    found = farthest(placed(made.glb), truth)
    bound = finest["error_max"] * across
    assert found <= bound + np.spacing(np.abs(truth).max())  # what the reader here rounds
    if quantise is None:
        assert bound == pytest.approx(lost, rel=1e-5) and found > 0.5 * bound
    nodes = document(made.glb)["nodes"]
    assert len(nodes) == 3 and len({str(node["translation"]) for node in nodes}) == 1
    for at in range(3):
        level = placed(made.glb, at)
        assert (np.abs(level - truth.mean(axis=0)) < 1).all()
    (first, *_) = decode_glb(made.glb)
    assert np.abs(first.mesh.absolute_positions - placed(made.glb)).max() < 2e-7 * across
    assert list(check_mesh(made.glb, "a.glb")) == []


@pytest.mark.parametrize(("shift",), sample([(shift,) for shift in FAR.values()], every=9), ids=FAR)
def test_levels_of_a_model_far_away_are_those_of_it_near_by(
    tmp_path: Path, shift: tuple[float, float, float]
) -> None:
    near, far = (
        bake_mesh(write(tmp_path / "a.obj", hills(at)), lods=3).report["lods"] for at in ((0, 0, 0), shift)
    )
    for a, b in zip(near, far, strict=True):
        assert b["triangles"] == pytest.approx(a["triangles"], rel=0.01)
        for key in ("error_max", "error_rms", "normal_mean_deg", "tangent_p99_deg"):
            assert b[key] == pytest.approx(a[key], rel=0.05, abs=2e-6)


def test_a_model_near_the_origin_stays_as_its_text_has_it(tmp_path: Path) -> None:
    truth = hills((7.0, -3.0, 5.5))
    made = bake_mesh(write(tmp_path / "a.obj", truth), lods=2)
    assert made.report["origin"] == [0, 0, 0]
    assert all("translation" not in node for node in document(made.glb)["nodes"])
    assert {tuple(row) for row in decode_glb(made.glb)[0].mesh.positions.tolist()} == {
        tuple(row) for row in truth.astype(np.float32).tolist()
    }
    assert made.report["lods"][0]["error_max"] == made.report["loading"]["load_max"] > 0


def test_two_texts_that_are_one_vertex_are_both_inside_what_is_told(tmp_path: Path) -> None:
    """Of 0.1 and of what float32 rounds to the same number, in either order the farther one counts."""
    near, far = "0.1", "0.1000000045"  # the float32 is 0.100000001490...
    for first, second in ((near, far), (far, near)):
        (tmp_path / "a.obj").write_text(
            f"v {first} 0 0\nv {second} 0 0\nv 1 0 0\nv 0 1 0\nf 1 3 4\nf 2 4 3\n"
        )
        read = read_obj(tmp_path / "a.obj")
        assert len(read.mesh.positions) == 3
        report = bake_mesh(tmp_path / "a.obj").report["loading"]["load_max_m"]
        assert report == pytest.approx(float(Fraction(far) - Fraction(float(np.float32(0.1)))), rel=1e-4)


@pytest.mark.parametrize("reach", sample([1e12, 1e13, 1e14], every=3))
def test_where_float64_has_no_digits_left_the_loss_is_bounded_and_told(tmp_path: Path, reach: float) -> None:
    """The text has every digit: the bound holds against exact fractions of it."""
    exact = [[Fraction(value) + Fraction(reach) for value in row] for row in hills().tolist()]
    path = write(tmp_path / "a.obj", hills())
    rest = path.read_text().splitlines()[len(exact) :]
    digits = [f"{int(value)}.{int(value % 1 * 10**12):012d}" for row in exact for value in row]
    rows = [f"v {' '.join(digits[k : k + 3])}" for k in range(0, len(digits), 3)]
    path.write_text("\n".join(rows + rest))
    made = bake_mesh(path, lods=1)
    assert made.report["warnings"][0].startswith(f"{path}: coordinates reach {reach:g} m, and rounding moves")
    read = read_obj(path)
    text = np.array([Fraction(value) for value in digits], object).reshape(-1, 3)
    order = {tuple(row): at for at, row in enumerate(read.source.positions.tolist())}
    most = 0.0
    for row in text:
        at = order[tuple(float(value) for value in row)]
        apart = [
            Fraction(origin) + Fraction(float(offset)) - value
            for origin, offset, value in zip(read.mesh.origin, read.mesh.positions[at], row, strict=True)
        ]
        most = max(most, float(sum(x * x for x in apart)) ** 0.5)
    assert 0 < most <= made.report["loading"]["load_max_m"] * (1 + 1e-6)


def test_a_part_left_at_the_origin_costs_a_model_far_away_no_digit(tmp_path: Path) -> None:
    truth = hills((1e6, 0.0, -1e6))
    last = len(truth) + 1
    path = write(tmp_path / "a.obj", truth, f"v 0 0 0\nf 1 2 {last}\n")
    made = bake_mesh(path, lods=1)
    assert made.report["triangles"] == 2 * SIDE * SIDE + 1
    found = placed(made.glb)
    near = found[np.abs(found - truth.mean(axis=0)).max(axis=1) < 10]
    assert farthest(near, truth) < 1e-6


def test_small_things_far_from_a_model_at_the_origin_are_told_where_they_collapse(tmp_path: Path) -> None:
    truth = hills()
    last = len(truth)
    far = "".join(f"v {1e7 + x!r} 0 {z!r}\n" for x, z in ((0.0, 0.0), (0.01, 0.0), (0.0, 0.01)))
    faces = f"f {last + 1} {last + 2} {last + 3}\n"
    line = len(write(tmp_path / "a.obj", truth).read_text().splitlines()) + 4
    report = bake_mesh(write(tmp_path / "a.obj", truth, far + faces), lods=1).report
    assert report["loading"]["collapsed"] == 1 and report["loading"]["load_max_m"] == pytest.approx(
        0.01, rel=1e-3
    )
    assert f"1 triangles lose their area (first: line {line})" in " ".join(report["warnings"])


@pytest.mark.parametrize(("many", "away"), [(True, 3e4), (False, 1e4)])
def test_a_part_that_rounding_moves_by_much_of_its_size_is_told(
    tmp_path: Path, many: bool, away: float
) -> None:
    """Of the whole it is next to nothing, and the rest of the model is all or nearly all of its surface."""
    truth = hills()
    last = len(truth)
    far = hills((away, 0.0, 0.0)) if many else hills((away, 0.0, 0.0), 0.01)[:3]
    lines = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in far.tolist())
    faces = "".join(f"f {last + k} {last + k + 1} {last + k + 2}\n" for k in range(1, len(far) - 1))
    plain = write(tmp_path / "a.obj", truth)
    line = len(plain.read_text().splitlines()) + len(far) + 1
    assert not bake_mesh(plain, lods=1).report["warnings"]
    report = bake_mesh(write(tmp_path / "a.obj", truth, lines + faces), lods=1).report
    assert report["loading"]["load_max"] < 1e-6 and not report["loading"]["collapsed"]
    message = " ".join(report["warnings"])
    most = report["loading"]["load_max_m"]
    assert f"rounding moves vertices of the part at line {line} by up to {most:.3g} m" in message
    assert "of its own diagonal); move distant parts into separate files" in message


def test_signs_of_zero_denormals_and_the_largest_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text("v -0 0 -0.0\nv 1e-42 0 0\nv 0 1e-42 1e-320\nf 1 2 3\n")
    made = bake_mesh(path, lods=1)
    assert made.report["triangles"] == 1 and made.report["origin"] == [0, 0, 0]
    path.write_text("v 1e38 0 0\nv 1.5e38 0 0\nv 1e38 1e37 0\nf 1 2 3\n")
    assert bake_mesh(path, lods=1).report["loading"]["load_max"] < 1e-6
    path.write_text("v -2e38 0 0\nv 2e38 0 0\nv 0 1e37 0\nf 1 2 3\n")
    with pytest.raises(SourceError, match=r"a coordinate of 2e\+38 metres, limit 1\.7e\+38"):
        bake_mesh(path, lods=1)
    path.write_text("v 1e38 0 0\nv 100000000000000000000000000000000000001 0 0\nv 1e38 1 0\nf 1 2 3\n")
    with pytest.raises(SourceError, match="all 1 triangles are degenerate"):
        bake_mesh(path, lods=1)


def _levels(*origins: tuple[float, float, float]) -> tuple[Lod, ...]:
    return tuple(
        Lod(replace(sphere(8), origin=origin), 0.01 * k, 0.01 * k) for k, origin in enumerate(origins)
    )


@pytest.mark.parametrize("origin", [(1e6, 0.0, -3.25), (0.1, 5_234_567.1, 0.0)])
def test_what_is_read_back_is_what_was_written(origin: tuple[float, float, float]) -> None:
    for lods in (_levels(origin, origin), quantised_levels(_levels(origin, origin))):
        data = encode_glb(lods, "ball")
        back = decode_glb(data)
        again = encode_glb(back, "ball")
        assert document(again)["nodes"] == document(data)["nodes"]
        for lod, found in zip(lods, back, strict=True):
            step = lod.quantised.grid.step[0] if lod.quantised else 0.0
            assert (
                np.abs(found.mesh.absolute_positions - lod.mesh.absolute_positions).max()
                <= 0.51 * step + 1e-9
            )


def test_levels_that_stand_apart_are_refused_and_found() -> None:
    here, there = (1e6, 0.0, 0.0), (1e6, 0.5, 0.0)
    data = encode_glb(_levels(here, here), "ball")
    tree: dict[str, Any] = document(data)
    tree["nodes"][1]["translation"] = list(there)
    with pytest.raises(FormatError, match="one translation and one scale"):
        decode_glb(with_document(data, tree))
    (finding,) = check_mesh(with_document(data, tree), "ball.glb")
    assert finding.code == "PZ209" and "0.14" in finding.what
    tree["nodes"][1]["translation"] = [1e6, 0.0]
    (finding,) = check_mesh(with_document(data, tree), "ball.glb")
    assert finding.code == "PZ102" and "translation" in finding.what


def test_the_nearest_places_of_a_mesh_are_where_its_node_puts_them() -> None:
    """Of floats and of codes, near and far."""
    for origin in ((0.0, 0.0, 0.0), (1e6, 0.0, -1e6)):
        for lods in (_levels(origin), quantised_levels(_levels(origin))):
            places = np.array(sample_points(encode_glb(lods, "ball"), "ball")) - origin
            assert np.abs(places).max() == pytest.approx(1.0, abs=1e-4)
            assert np.linalg.norm(places, axis=1).min() > 0.9


def test_a_triangle_that_loses_its_area_counts_as_turned_by_a_right_angle() -> None:
    text = np.array([[1, 0, 0], [1 + 1e-9, 0, 0], [1, 1e-9, 0]])
    found = loading(np.float32(text * [1, 0, 1]), (0.0, 0.0, 0.0), text, np.array([[0, 1, 2]], np.uint32))
    assert (found.collapsed, found.first_collapsed, found.turned_p99_deg) == (1, 0, 90.0)
