"""OBJ and MTL: every face of a file is in the result or in the warnings, and every fault has its line."""

from __future__ import annotations

import os
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.errors import SourceError
from paradize.readers.obj import read_obj
from paradize.readers.record import UNKNOWN_SMOOTHING, Model
from tests.processor_time import ratio
from tests.sweeps import tries

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def read(tmp_path: Path, text: str | bytes, name: str = "a.obj") -> Model:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_obj(path)


def area(result: Model) -> float:
    p = result.mesh.positions[result.mesh.triangles].astype(float)
    return float(0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum())


def test_positions_uvs_and_normals_are_shared_by_index_and_v_is_turned_once(tmp_path: Path) -> None:
    mesh = read(
        tmp_path,
        TRIANGLE + "v 1 1 0\nvt 0 0\nvt 1 0.25\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1\nf 3/1/1 2/2/1 4/2/1\n",
    ).mesh
    assert len(mesh.positions) == 4
    assert mesh.uvs is not None and mesh.normals is not None
    assert mesh.uvs.tolist() == [[0, 1], [1, 0.75], [0, 1], [1, 0.75]]
    assert mesh.normals.tolist() == [[0, 0, 1]] * 4
    assert mesh.triangles.tolist() == [[0, 1, 2], [2, 1, 3]]


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("last", ["", "\n"])
def test_line_endings_tabs_blanks_and_a_byte_order_mark_change_nothing(
    tmp_path: Path, ending: str, last: str
) -> None:
    lines = ["# a comment \\", "v\t0 0  0", " v 1 0 0 # behind", "", "v 0 1\t0 ", "f 1 2 3"]
    result = read(tmp_path, b"\xef\xbb\xbf" + (ending.join(lines) + last.replace("\n", ending)).encode())
    assert result.mesh.triangles.tolist() == [[0, 1, 2]]
    assert result.lines.tolist() == [6]


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r", " \n"])
def test_a_backslash_continues_a_line_and_lines_are_still_counted(tmp_path: Path, ending: str) -> None:
    text = TRIANGLE + f"f 1 \\{ending} 2\\{ending}3\nf 1 2 9\n"
    with pytest.raises(SourceError, match=r"line 7: position index 9 is out of range 1 to 3"):
        read(tmp_path, text)
    assert len(read(tmp_path, text.replace("f 1 2 9", "f 2 1 3")).mesh.triangles) == 2


def test_negative_indices_count_back_from_their_own_line(tmp_path: Path) -> None:
    text = TRIANGLE + "f -3 -2 -1\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf -3 -2 -1\n"
    mesh = read(tmp_path, text).mesh
    assert mesh.positions[mesh.triangles[1]][:, 2].tolist() == [1, 1, 1]


def test_faces_may_come_before_their_vertices(tmp_path: Path) -> None:
    assert len(read(tmp_path, "f 1 2 3\n" + TRIANGLE).mesh.triangles) == 1


def regular(count: int) -> str:
    angle = np.arange(count) * 2 * np.pi / count
    rows = [f"v {np.cos(a):.9f} {np.sin(a):.9f} 0" for a in angle]
    return "\n".join(rows) + "\nf " + " ".join(map(str, range(1, count + 1))) + "\n"


@pytest.mark.parametrize("count", [3, 4, 5, 7, 100, 5000])
def test_a_convex_polygon_of_any_size_gives_two_triangles_less_than_corners(
    tmp_path: Path, count: int
) -> None:
    result = read(tmp_path, regular(count))
    assert len(result.mesh.triangles) == count - 2
    assert area(result) == pytest.approx(0.5 * count * np.sin(2 * np.pi / count), rel=1e-5)


def comb(teeth: int) -> list[tuple[float, float]]:
    points = [(0.0, 0.0)]
    for i in range(teeth):
        points += [(i + 0.5, 3.0), (i + 1.0, 0.5 if i + 1 < teeth else 0.0)]
    return points


def shoelace(points: list[tuple[float, float]]) -> float:
    following = points[1:] + points[:1]
    return abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(points, following, strict=True))) / 2


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    "outline",
    [
        [(0, 0), (2, 0), (0.5, 0.5), (0, 2)],
        [(0, 0), (4, 0), (4, 4), (2, 1), (0, 4)],
        [(0, 0), (4, 0), (4, 4), (2, 2), (0, 4)],  # a corner on two diagonals
        [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)],
        comb(40),
    ],
)
def test_a_concave_polygon_keeps_its_area_and_its_side(
    tmp_path: Path, axis: int, turned: bool, outline: list[tuple[float, float]]
) -> None:
    points = outline[::-1] if turned else outline
    rows = [np.roll((x, y, 0.25 * x), axis) for x, y in points]
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in rows)
    result = read(tmp_path, text + "f " + " ".join(str(i + 1) for i in range(len(points))) + "\n")
    assert len(result.mesh.triangles) == len(points) - 2
    assert area(result) == pytest.approx(shoelace(outline) * np.sqrt(1 + 0.25**2), rel=1e-6)
    p = result.mesh.positions[result.mesh.triangles].astype(float)
    normals = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    assert (normals @ normals.sum(axis=0) > 0).all()


def holed(holes: int) -> tuple[list[tuple[float, float]], float]:
    """A long plate with square holes, each reached by a bridge there and back from the plate's lower edge, as
    exporters write it; and its area."""
    points: list[tuple[float, float]] = []
    for i in range(holes):
        x = 4.0 * i
        points += [(x, 0), (x + 1, 1), (x + 1, 3), (x + 3, 3), (x + 3, 1), (x + 1, 1), (x, 0)]
    return [*points, (4.0 * holes, 0), (4.0 * holes, 4), (0, 4)], 12.0 * holes


@pytest.mark.parametrize("holes", [1, 2, 7])
@pytest.mark.parametrize("turned", [False, True])
def test_a_polygon_with_bridged_holes_keeps_its_area_and_its_side(
    tmp_path: Path, holes: int, turned: bool
) -> None:
    points, wanted = holed(holes)
    points = points[::-1] if turned else points
    numbers = {point: i for i, point in enumerate(dict.fromkeys(points), 1)}
    text = "".join(f"v {x} 0.5 {y}\n" for x, y in numbers)
    result = read(tmp_path, text + "f " + " ".join(str(numbers[point]) for point in points) + "\n")
    assert len(result.mesh.triangles) == len(points) - 2
    assert area(result) == pytest.approx(wanted, rel=1e-6)
    p = result.mesh.positions[result.mesh.triangles].astype(float)
    up = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 1]
    assert (up >= 0).all() if turned else (up <= 0).all()
    assert not any("crosses" in warning for warning in result.warnings)


@pytest.mark.parametrize("bend", [0.05, 0.3])
def test_a_bent_concave_polygon_never_folds_over(tmp_path: Path, bend: float) -> None:
    """Corners off their plane: seen along the polygon's normal, its triangles still tile it."""
    outline = comb(12)
    text = "".join(f"v {x} {y} {bend * np.sin(3 * x + y)}\n" for x, y in outline)
    result = read(tmp_path, text + "f " + " ".join(str(i + 1) for i in range(len(outline))) + "\n")
    p = result.mesh.positions[result.mesh.triangles].astype(float)
    flat = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 2] / 2
    assert (flat > 0).all() or (flat < 0).all()
    assert abs(flat.sum()) == pytest.approx(shoelace(outline), rel=1e-5)


def test_an_outline_that_crosses_itself_is_cut_and_told(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3 4\n"
    result = read(tmp_path, text)
    assert len(result.mesh.triangles) == 2
    assert any("crosses itself" in warning for warning in result.warnings)


def test_an_outline_that_winds_round_its_first_corner_more_than_once_is_warned_about(tmp_path: Path) -> None:
    """Five corners 108 degrees apart: each turns the same way, 1.2 times round in all."""
    around = np.radians(108.0 * np.arange(5))
    rows = "".join(f"v {np.cos(a):.6f} {np.sin(a):.6f} 0\n" for a in around)
    result = read(tmp_path, f"v 0 0 0\n{rows}f 1 2 3 4 5 6\n")
    assert any("crosses itself" in warning for warning in result.warnings)


def test_a_hostile_polygon_costs_bounded_work(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)

    def polygon(count: int) -> tuple[str, int]:
        rows = "".join(f"v {x:.6f} {y:.6f} 0\n" for x, y in rng.random((count, 2)).tolist())
        return rows + "f " + " ".join(map(str, range(1, count + 1))) + "\n", count

    def cut(text: str, count: int) -> None:
        result = read(tmp_path, text)
        assert len(result.mesh.triangles) == count - 2
        assert any("beyond the work limit; triangles may overlap" in warning for warning in result.warnings)

    few, many = polygon(10_000), polygon(100_000)
    # 10; 100 where each corner looks at all others.
    assert ratio(lambda: cut(*many), lambda: cut(*few)) < 20


def test_corners_without_uv_or_normal_are_filled_in_and_told(tmp_path: Path) -> None:
    text = TRIANGLE + "vt 0.5 0.5\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 3 2 1\nf 1//1 2//1 3//1\n"
    lay_maps(tmp_path)
    result = read(tmp_path, "mtllib m.mtl\nusemtl mapped\n" + text)
    assert result.mesh.uvs is not None and result.mesh.normals is not None
    assert result.counts["faces_without_uv"] == 2 and result.counts["faces_without_normal"] == 1
    assert (result.mesh.normals[result.mesh.triangles[1]] == 0).all()
    assert sum("computed" in warning or "(0, 0)" in warning for warning in result.warnings) == 2


def lay_maps(folder: Path) -> None:
    """Materials with a map and without."""
    (folder / "a.png").write_bytes(b"a picture")
    (folder / "m.mtl").write_text("newmtl mapped\nmap_Kd a.png\nnewmtl plain\nKd 1 0 0\n")


def test_faces_without_texture_coordinates_are_told_only_where_their_material_has_a_map(
    tmp_path: Path,
) -> None:
    lay_maps(tmp_path)
    head = "mtllib m.mtl\n" + TRIANGLE + "v 1 1 0\nvt 0 1\nvt 1 0\nvt 0 0\n"
    plain, sound, bare = "usemtl plain\nf 1 2 3\nf 2 3 4\n", "f 1/1 2/2 3/3\n", "f 1 2 4\n"
    for text, told in (
        (plain + "usemtl mapped\n" + sound, []),
        (plain + "usemtl mapped\n" + sound + bare, ["line 14: 1 of 4 triangles without texture coordinates"]),
        ("usemtl mapped\n" + sound + bare, ["line 11: 1 of 2 faces without texture coordinates"]),
        (plain + sound, []),
        ("usemtl nowhere\n" + bare + sound, []),
    ):
        warnings = [said for said in read(tmp_path, head + text).warnings if "without texture" in said]
        assert [said.split(": ", 1)[1].partition(";")[0] for said in warnings] == told, text


def test_vertex_colours_are_read_and_split_vertices(tmp_path: Path) -> None:
    text = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0 0.5\nv 0 1 0\nv 0 0 0 0 0 1\nf 1 2 3\nf 4 3 2\n"
    mesh = read(tmp_path, text).mesh
    assert mesh.colors is not None
    assert mesh.colors.tolist() == [[1, 0, 0, 1], [0, 1, 0, 0.5], [1, 1, 1, 1], [0, 0, 1, 1]]


@pytest.mark.parametrize("word", ["nan", "-nan(ind)", "inf", "-1.#IND00", "1.#QNAN", "-1.#INF"])
def test_texture_coordinates_and_normals_that_are_not_finite_are_left_out_and_told(
    tmp_path: Path, word: str
) -> None:
    text = TRIANGLE + f"vt 0.5 0.25\nvt 0.5 {word}\nvn 0 0 1\nvn {word} 0 1\nvn 0 0 {word}\n"
    found = read(tmp_path, text + "f 1/1/1 2/2/2 3/1/3\n")
    assert found.mesh.uvs is not None and found.mesh.normals is not None
    assert found.mesh.uvs.tolist() == [[0.5, 0.75], [0.0, 1.0], [0.5, 0.75]]
    assert found.mesh.normals.tolist() == [[0, 0, 1], [0, 0, 0], [0, 0, 0]]  # zeros are computed
    assert [said.partition(": ")[2] for said in found.warnings] == [
        "line 5: 1 texture coordinates that are not finite; read as 0 0",
        "line 7: 2 normals that are not finite; computed",
    ]


def test_a_texture_map_of_the_format_is_told(tmp_path: Path) -> None:
    found = read(tmp_path, TRIANGLE + "maplib a.map\nusemap wood\nf 1 2 3\n")
    assert "line 4: 2 statements usemap or maplib ignored: name the picture as map_Kd" in found.warnings[0]


def test_polypaint_of_zbrush_is_read_or_told(tmp_path: Path) -> None:
    painted = read(tmp_path, TRIANGLE + "#MRGB ffff8000ff00ff00ff0000ff\nf 1 2 3\n")
    assert painted.mesh.colors is not None and not painted.warnings
    assert np.allclose(painted.mesh.colors[0], [1.0, 0.2158605, 0.0, 1.0], atol=1e-6)
    short = read(tmp_path, TRIANGLE + "#MRGB ffff8000\nf 1 2 3\n")
    assert short.mesh.colors is None and "line 4: polypaint (#MRGB) is not one colour" in short.warnings[0]


def test_vertex_colours_in_whole_numbers_are_codes(tmp_path: Path) -> None:
    text = "v 0 0 0 255 0 128\nv 1 0 0 0 0 0\nv 0 1 0 255 255 255\nf 1 2 3\n"
    found = read(tmp_path, text)
    assert found.mesh.colors is not None
    assert np.allclose(found.mesh.colors[0], [1.0, 0.0, 0.2158605, 1.0], atol=1e-6)
    assert any("whole numbers up to 255; read as codes" in said for said in found.warnings)
    ones = read(tmp_path, text.replace("255", "1").replace("128", "1"))
    assert ones.mesh.colors is not None and ones.mesh.colors.max() == 1.0 and not ones.warnings


def test_a_material_file_of_the_models_name_defines_what_no_other_does(tmp_path: Path) -> None:
    faces = TRIANGLE + "usemtl wood\nf 1 2 3\nusemtl stone\nf 3 2 1\n"
    (tmp_path / "a.obj").write_text("mtllib first.mtl gone.mtl\n" + faces)
    (tmp_path / "first.mtl").write_text("newmtl wood\nKd 1 0 0\n")
    (tmp_path / "a.mtl").write_text("newmtl wood\nKd 0 1 0\nnewmtl stone\nKd 0 0 1\n")
    found = read_obj(tmp_path / "a.obj")
    assert [found.materials[name].color for name in ("wood", "stone")] == [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    assert any("no mtllib line names 'a.mtl'" in said for said in found.warnings)
    assert not any("used but not defined" in said for said in found.warnings)
    assert tmp_path / "a.mtl" in found.libraries


def test_a_material_that_no_file_defines_is_told_with_the_files_that_were_read(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("mtllib first.mtl\n" + TRIANGLE + "usemtl stone\nf 3 2 1\n")
    (tmp_path / "b.obj").write_text(TRIANGLE + "usemtl stone\nf 3 2 1\n")
    (tmp_path / "first.mtl").write_text("newmtl wood\nKd 1 0 0\n")
    (told,) = read_obj(tmp_path / "a.obj").warnings
    assert told.endswith("no `newmtl` line of 'first.mtl' names it")
    (told,) = read_obj(tmp_path / "b.obj").warnings
    assert told.endswith("a `mtllib` line names the file that defines them")


def test_groups_objects_and_materials_become_runs(tmp_path: Path) -> None:
    faces = "o house\nf 1 2 3\nusemtl red tile\nf 1 2 3\ng roof  top\nf 1 2 3\nf 1 2 3\nusemtl b\nf 1 2 3\n"
    groups = read(tmp_path, TRIANGLE + faces).mesh.groups
    assert [(g.name, g.material, g.first, g.count) for g in groups] == [
        ("house", "default", 0, 1),
        ("house", "red tile", 1, 1),
        ("roof  top", "red tile", 2, 2),
        ("roof  top", "b", 4, 1),
    ]


def test_smoothing_groups_reach_every_triangle(tmp_path: Path) -> None:
    text = TRIANGLE + "v 1 1 0\nf 1 2 3\ns 7\nf 1 2 4 3\ns off\nf 1 2 3\ns 0\nf 1 2 3\ns wavy\nf 1 2 3\n"
    result = read(tmp_path, text)
    assert result.smoothing.tolist() == [UNKNOWN_SMOOTHING, 7, 7, 0, 0, 0]
    assert any("smoothing" in warning for warning in result.warnings)


def test_what_older_programs_write_changes_nothing(tmp_path: Path) -> None:
    """`fo` is a face, and 1 is every position's weight."""
    new, old = (
        read(tmp_path, TRIANGLE + "f 1 2 3\n"),
        read(tmp_path, TRIANGLE.replace("0\n", "0 1\n") + "fo 1 2 3\n"),
    )
    assert np.array_equal(old.mesh.positions, new.mesh.positions)
    assert np.array_equal(old.mesh.triangles, new.mesh.triangles)
    assert old.warnings == new.warnings


def test_lines_points_short_faces_and_unknown_keywords_are_counted(tmp_path: Path) -> None:
    text = TRIANGLE + "l 1 2\nl 2 3\np 1\nf 1 2\nf\nwobble 3\nwobble 4\ncurv 0 1 1 2\nf 1 2 3\n"
    result = read(tmp_path, text)
    assert (result.counts["lines"], result.counts["points"], result.counts["short_faces"]) == (2, 1, 2)
    assert sum("wobble" in warning for warning in result.warnings) == 1
    assert any("line 9: 2 statements with the unknown keyword" in warning for warning in result.warnings)
    assert any("fewer than three" in warning for warning in result.warnings)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("v 1 2 nan", r"line 4: \"nan\" is not a finite number in 'v'"),
        ("v 1 -inf 2", r"line 4: \"-inf\" is not a finite number"),
        ("v 1 1e400 2", r"line 4: \"1e400\" is too large"),
        ("v 1 3.5e38 2", r"line 4: \"3.5e38\" is too large"),
        ("v 1,5 2 3", r"line 4: \"1,5\" is not a number in 'v'"),
        ("v 1 2", r"line 4: 'v' needs 3 numbers, found 2"),
        ("v", r"line 4: 'v' needs 3 numbers, found 0"),
        ("v 1 2 0x10", r"\"0x10\" is not a number"),
        ("v 1 2 3..4", r"is not a number"),
        ("v 1 2 --3", r"is not a number"),
        ("vn 1 2", r"'vn' needs 3"),
        ("vt", r"'vt' needs 1"),
        ("f 1 2 0", r"line 4: position index 0 is out of range 1 to 3"),
        ("f 1 2 4", r"line 4: position index 4 is out of range 1 to 3"),
        ("f 1 2 -4", r"line 4: position index -4 reaches before the first of 3"),
        ("f 1/1 2/1 3/1", None),
        ("f 1//2 2//2 3//2", None),
        ("f 1//0 2//0 3//0", None),
        ("f 1//-1 2//-1 3//-1", None),
        ("f 1 2 99999999999999999999", r"is not a face corner"),
        ("f 1 2 3/", None),
        ("f 1 2 3//", None),
        ("f 1.0 2 3", r"\"1.0\" is not a face corner"),
        ("f 1/1/1/1 2 3", r"is not a face corner|out of range"),
        ("f a b c", r"\"a\" is not a face corner"),
    ],
)
def test_a_fault_is_told_with_file_and_line(tmp_path: Path, line: str, said: str | None) -> None:
    text = TRIANGLE + line + "\nf 1 2 3\n"
    if said is None:
        assert len(read(tmp_path, text).mesh.triangles) == 2
        return
    with pytest.raises(SourceError, match=said) as raised:
        read(tmp_path, text)
    assert raised.value.file == str(tmp_path / "a.obj")


CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n"


@pytest.mark.parametrize("broken", ["0", "9", "-9", "4294967293", "4294967294", "4294967295", "99999999999"])
def test_a_corner_is_read_without_the_uv_or_normal_that_is_not_there(tmp_path: Path, broken: str) -> None:
    sound = "f 1/1/1 2/2/1 3/3/1\n"
    text = f"{CORNERS}f 1/{broken}/1 2/2/{broken} 3/3/{broken}\n{sound}f 1/{broken} 2/{broken} 3/{broken}\n"
    result = read(tmp_path, text)
    alike = read(tmp_path, f"{CORNERS}f 1//1 2/2 3/3\n{sound}f 1 2 3\n")
    for values, expected in zip(
        *([m.triangles, m.positions, m.uvs, m.normals] for m in (result.mesh, alike.mesh)), strict=True
    ):
        assert values is not None and expected is not None and (values == expected).all()
    assert result.repairs["broken_uvs"] == {"count": 4, "triangle": None, "line": 8}
    assert result.repairs["broken_normals"] == {"count": 2, "triangle": None, "line": 8}
    assert f"{tmp_path / 'a.obj'}: line 8: 4 face corners name texture coordinates" in " ".join(
        result.warnings
    )


@pytest.mark.parametrize("before", ["", "f 1//1 2//1 3//1\n"])
def test_a_normal_right_behind_the_last_is_not_there(tmp_path: Path, before: str) -> None:
    result = read(tmp_path, f"{CORNERS}{before}f 1//1 2//1 3//2\n")
    assert result.repairs["broken_normals"]["count"] == 1


def test_a_uv_may_stand_behind_the_face_that_names_it(tmp_path: Path) -> None:
    face, uvs = "f 1/1 2/2 3/3\n", "vt 0 0\nvt 1 0\nvt 0 1\n"
    after, before = (read(tmp_path, TRIANGLE + text) for text in (face + uvs, uvs + face))
    assert after.mesh.uvs is not None and (after.mesh.uvs == before.mesh.uvs).all()
    assert after.repairs["broken_uvs"]["count"] == 0
    late = read(tmp_path, TRIANGLE + "f 1/1 2/1 3/4\n" + uvs + "f 1/1 2/5 3/1\n")  # the first of them is told
    assert late.repairs["broken_uvs"] == {"count": 2, "triangle": None, "line": 4}


def test_a_model_without_any_sound_uv_has_none(tmp_path: Path) -> None:
    model = read(tmp_path, TRIANGLE + "f 1/1/1 2/1/1 3/1/1\n")
    assert model.mesh.uvs is None and model.mesh.normals is None and len(model.mesh.triangles) == 1


def test_every_fault_of_a_file_is_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=r"line 2: .*and 2 more, lines 4, 5"):
        read(tmp_path, "v 0 0 0\nv x 0 0\nv 0 0 0\nv 0 0\nf 1 2 9\n")


def test_a_line_with_several_faults_is_named_once(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=r"line 1: .*and 2 more, line 3\)"):
        read(tmp_path, "v x 0 0\nv 0 0 0\nf 9 8 y\n")


@pytest.mark.parametrize(
    "text", ["\n\n", "v 0 0 0\n", TRIANGLE + "l 1 2\n", TRIANGLE + "f 1 2\n", TRIANGLE + "\0\0\0"]
)
def test_a_file_without_faces_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(SourceError, match="no faces"):
        read(tmp_path, text)


def test_what_is_not_a_readable_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=r"missing\.obj"):
        read_obj(tmp_path / "missing.obj")
    with pytest.raises(SourceError, match="is a folder, not an OBJ, glTF, PLY or STL model"):
        read_obj(tmp_path)
    for data, kind in ((b"", "an empty file"), (b"\0\0\0", "a binary file"), (b"OggS\0", "an Ogg sound")):
        with pytest.raises(SourceError, match=f"is {kind}.*, not an OBJ, glTF, PLY or STL model"):
            read(tmp_path, data)
    os.mkfifo(tmp_path / "pipe.obj")
    with pytest.raises(SourceError, match="is not a regular file"):
        read_obj(tmp_path / "pipe.obj")
    with pytest.raises(SourceError, match="UTF-16"):
        read(tmp_path, TRIANGLE.encode("utf-16"))


NUMBERS = ["16777217", "0.1", "1e-45", "1e-46", "-0", "3.4028234e38", "1.17549435e-38", "5e-324", "1e-400"]
NUMBERS += [
    "0.000000000000000000000000000000000000000000001",
    "123456789012345678901234567890e-20",
    ".5",
    "5.",
]
NUMBERS += ["+3", "7.0000005960464477540", "1.00000005960464477539", "33554435", "1E2", "9007199254740993"]


def nearest_float32(text: str) -> np.float32:
    """The float32 nearest to a decimal, ties to even, by exact arithmetic."""
    value = Decimal(text)
    guess = np.float32(float(value))
    with np.errstate(over="ignore"):
        around = [np.nextafter(guess, np.float32(-np.inf)), guess, np.nextafter(guess, np.float32(np.inf))]
    finite = [x for x in around if np.isfinite(x)]
    return min(finite, key=lambda x: (abs(Decimal(float(x)) - value), int(x.view(np.uint32)) & 1))


def positions_of(tmp_path: Path, numbers: list[str]) -> list[np.float32]:
    """Of vertices whose x is a number each, beside twice as many at 0: so the origin is 0."""
    rows = "".join(f"v {number} {i} 0\nv 0 {i} 1\nv 0 {i} 2\n" for i, number in enumerate(numbers))
    faces = "".join(f"f {i} {i + 1} {i + 2}\n" for i in range(1, 3 * len(numbers), 3))
    mesh = read(tmp_path, rows + faces).mesh
    assert mesh.origin == (0, 0, 0)
    by_row = {int(y): x for x, y, z in mesh.positions if z == 0}
    return [by_row[i] for i in range(len(numbers))]


def test_numbers_are_the_nearest_float32(tmp_path: Path) -> None:
    for text, found in zip(NUMBERS, positions_of(tmp_path, NUMBERS), strict=True):
        assert found == nearest_float32(text), text


@given(
    st.lists(
        st.tuples(st.integers(-(10**19), 10**19), st.integers(-60, 18)),
        min_size=3,
        max_size=40,
    )
)
@settings(max_examples=tries(60), deadline=None)
def test_any_decimal_is_the_nearest_float32(
    tmp_path_factory: pytest.TempPathFactory, parts: list[tuple[int, int]]
) -> None:
    numbers = [f"{mantissa}e{exponent}" for mantissa, exponent in parts]
    for text, found in zip(numbers, positions_of(tmp_path_factory.mktemp("n"), numbers), strict=True):
        assert found == nearest_float32(text), text


@given(st.text(alphabet="vtnfgos 0123456789.-/\\\n\r\t#eu", max_size=300))
@settings(max_examples=tries(300), deadline=None)
def test_any_text_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    try:
        result = read(tmp_path_factory.getbasetemp(), text)
    except SourceError as error:
        assert error.file
        return
    mesh = result.mesh
    assert int(mesh.triangles.max()) < len(mesh.positions) and np.isfinite(mesh.positions).all()
