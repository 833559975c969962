"""`paradize new`: a scene of one's own without writing TOML."""

from __future__ import annotations

import errno
import os
import re
from math import asin, atan2, pi, sqrt
from pathlib import Path

import numpy as np
import pytest

from paradize.build.bake import bake
from paradize.build.materials.map_sets import find_map_sets
from paradize.build.options import BuildOptions
from paradize.checks import check_paths
from paradize.errors import BakeError, SourceError
from paradize.material import REPEATED
from paradize.new.scene import new_scene
from paradize.placement import to_world
from paradize.readers.obj import read_obj
from paradize.scene.placement import placed
from paradize.scene.settings import Scene, load_scene
from tests.pipeline.scenes import ball, write_image
from tests.sweeps import sweep

QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))


def write_model(folder: Path, obj: str, mtl: str, *maps: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "thing.obj").write_text(obj, encoding="utf-8")
    (folder / "thing.mtl").write_text(mtl, encoding="utf-8")
    for i, name in enumerate(maps):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_image(folder / name, np.full((16, 16, 3), 60 + 40 * i, np.uint8))
    return folder / "thing.obj"


def test_without_a_model_it_makes_a_scene_that_check_finds_sound(tmp_path: Path) -> None:
    scene = new_scene(tmp_path / "mine").scene
    assert list(check_paths([scene])) == []


@pytest.mark.deep
def test_without_a_model_it_makes_a_scene_that_bakes(tmp_path: Path) -> None:
    made = new_scene(tmp_path / "first")
    assert not made.notes
    report = bake(made.scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not report.errors and not report.warnings
    assert {"vase_mesh", "vase_color", "vase_normal", "terrain_mesh", "sky"} <= {
        row["name"] for row in report.rows
    }


@pytest.mark.parametrize(
    ("scale", "offset"),
    [(1.0, 0.0), (0.3, 5000.0), (1.0, -5_234_567.25), (3.0, 9e8), (1e-6, 0.0), (2e6, 1e9)],
)
def test_the_model_stands_on_the_ground_and_fills_every_view(
    tmp_path: Path, scale: float, offset: float
) -> None:
    vertices = [
        f"v {scale * x + offset:.12g} {scale * y + offset:.12g} {scale * z + offset:.12g}"
        for x, y, z in ((0, 0, 0), (3, 0, 0), (0, 1, 0), (0, 0, 2))
    ]
    source = write_model(tmp_path / "m", "\n".join(vertices) + "\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", "")
    scene = load_scene(new_scene(tmp_path / "s", source).scene)
    instance = scene.objects[0].instances[0]
    shown = read_obj(source).mesh.absolute_positions * instance.scale + np.array(instance.position)
    size = shown.max() - shown.min()
    grain = 1e-3 * size  # the scene's numbers tell five digits of the model's size
    assert abs(shown[:, 1].min()) <= grain
    middle = 0.5 * (shown.min(axis=0) + shown.max(axis=0))
    assert abs(middle[[0, 2]]).max() <= grain
    radius = 0.5 * float(np.sqrt(((shown.max(axis=0) - shown.min(axis=0)) ** 2).sum()))
    half = 0.5 * scene.flight.fov_deg * pi / 180.0
    for eye, target in zip(scene.flight.eye, scene.flight.target, strict=True):
        to_target = np.array(target.position) - np.array(eye.position)
        to_middle = middle - np.array(eye.position)
        away = sqrt(float(to_middle @ to_middle))
        across = np.cross(to_target, to_middle)
        off = atan2(sqrt(float(across @ across)), float(to_target @ to_middle))
        assert 0.4 * half < off + asin(radius / away) < 1.05 * half
        assert eye.position[1] > 0.0
    own = radius / instance.scale
    if not 0.05 <= own <= 500.0:  # shown a metre large, as far as a scale goes
        assert instance.scale == pytest.approx(min(max(1.0 / own, 1e-6), 1e6), rel=1e-3)
    assert scene.flight.near_m < 0.1 * radius and scene.terrain is not None
    assert scene.terrain.size_m[0] > 10.0 * radius


@pytest.mark.parametrize("height", [0.0, 0.005, 0.02, 1.0])
def test_no_model_is_so_flat_that_the_mesh_of_the_ground_may_hide_it(tmp_path: Path, height: float) -> None:
    corners = [(0, 0, 0), (3, 0, 0), (3, height, 2), (0, height, 2)]
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in corners)
    source = write_model(tmp_path / "m", f"{vertices}f 1 3 2\nf 1 4 3\n", "")
    scene = load_scene(new_scene(tmp_path / "s", source).scene)
    instance = scene.objects[0].instances[0]
    assert scene.terrain
    top = height * instance.scale + instance.position[1]
    assert top >= 1.9 * scene.terrain.max_error_m
    if height > 2.0 * scene.terrain.max_error_m:
        assert instance.position[1] == 0.0


PILLAR = [(x, y, z) for y in (0.0, 2.0) for x, z in ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1))]
SIDES = "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n"
FLOOR = [(-2.0, 0.001, -2.0), (-2.0, 0.001, 2.0), (2.0, 0.001, 2.0), (2.0, 0.001, -2.0)]


@pytest.mark.parametrize("floored", [False, True])
def test_the_ground_hides_no_floor_that_a_model_brings_along(tmp_path: Path, floored: bool) -> None:
    corners = PILLAR + (FLOOR if floored else [])
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in corners)
    faces = SIDES + ("f 9 10 11 12\n" if floored else "")
    source = write_model(tmp_path / "m", vertices + faces, "")
    scene = load_scene(new_scene(tmp_path / "s", source).scene)
    foot = scene.objects[0].instances[0].position[1]
    assert scene.terrain
    assert foot + FLOOR[0][1] >= 1.9 * scene.terrain.max_error_m if floored else foot == 0.0


def test_maps_and_materials_come_along_and_nothing_else(tmp_path: Path) -> None:
    obj = "mtllib thing.mtl\n" + QUAD + 'usemtl odd "name" = [x]\nf 1/1 2/2 3/3 4/4\n'
    mtl = 'newmtl odd "name" = [x]\nmap_Kd maps/skin.png\nmap_d maps/holes.png\n'
    source = write_model(tmp_path / "m", obj, mtl, "maps/skin.png", "maps/holes.png", "maps/unused.png")
    made = new_scene(tmp_path / "s", source)
    assert [file for file in made.files if file.startswith("model/")] == [
        "model/maps/holes.png", "model/maps/skin.png", "model/thing.mtl", "model/thing.obj",
    ]  # fmt: skip
    scene = load_scene(made.scene)
    material = scene.objects[0].materials['odd "name" = [x]']
    assert material.two_sided
    report = bake(made.scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not report.errors
    assert {path.name for path in (tmp_path / "m").rglob("*")} == {
        "thing.obj", "thing.mtl", "maps", "skin.png", "holes.png", "unused.png",
    }  # fmt: skip


def test_a_scene_sets_nothing_for_materials_whose_triangles_a_bake_drops(tmp_path: Path) -> None:
    obj = "mtllib thing.mtl\n" + QUAD + "v 2 0 0\nusemtl {}\nf 1/1 2/2 3/3 4/4\nusemtl {}\nf 1/1 2/2 5/3\n"
    mtl = "newmtl a\nmap_Kd skin.png\nmap_d holes.png\nnewmtl b\nmap_Kd skin.png\nmap_d holes.png\n"
    for kept, flat in (("a", "b"), ("b", "a")):
        source = write_model(tmp_path / f"m{kept}", obj.format(kept, flat), mtl, "skin.png", "holes.png")
        (item,) = load_scene(new_scene(tmp_path / f"s{kept}", source).scene).objects
        assert list(item.materials) == [kept]


def test_pictures_in_the_folder_above_come_along_and_no_others(tmp_path: Path) -> None:
    obj = "mtllib thing.mtl\n" + QUAD + "usemtl a\nf 1/1 2/2 3/3 4/4\n"
    mtl = "newmtl a\nmap_Kd ../textures/skin.png\nmap_Pr ..\\..\\far.png\n"
    source = write_model(tmp_path / "m/source", obj, mtl, "../textures/skin.png", "../../far.png")
    made = new_scene(tmp_path / "s", source)
    assert [file for file in made.files if file.startswith("model/")] == [
        "model/source/thing.mtl", "model/source/thing.obj", "model/textures/skin.png",
    ]  # fmt: skip
    assert any("some of its files lie in" in note for note in made.notes)
    assert any("far.png' lies outside" in note for note in made.notes)
    (item,) = load_scene(made.scene).objects
    (one,) = find_map_sets(load_scene(made.scene), made.scene).maps.sets
    assert one.pictures == {"color": item.mesh.parent.parent / "textures/skin.png"}


def test_a_model_without_a_material_file_is_told_to_be_white_and_which_picture_is_near(
    tmp_path: Path,
) -> None:
    source = write_model(
        tmp_path / "m", QUAD + "f 1/1 2/2 3/3\n", "newmtl a\n", "thing_texture.png", "other.png"
    )
    (note,) = [
        note
        for note in new_scene(tmp_path / "s", source).notes
        if "no material file, so it is drawn white" in note
    ]
    assert 'write color = "thing_texture.png" under [[object]]' in note
    for names, advised in (
        (("thing_ao.png", "thing_BaseColor.png", "thing_plain.png"), "thing_BaseColor.png"),
        (("thing_SSS.jpg", "thing_diffuse.tga", "thing_nm.png"), "thing_diffuse.tga"),
        (("thing_n.png", "thing.png"), "thing.png"),
        (("thing_roughness.png",), "PICTURE"),
    ):
        for old in source.parent.glob("thing*.*g*"):
            old.unlink()
        for name in names:
            (source.parent / name).touch()
        (note,) = [note for note in new_scene(tmp_path / advised, source).notes if "drawn white" in note]
        assert f'color = "{advised}" under' in note
    named = write_model(tmp_path / "n", "mtllib thing.mtl\n" + QUAD + "f 1/1 2/2 3/3\n", "newmtl a\n")
    assert not any("white" in note for note in new_scene(tmp_path / "t", named).notes)


def test_a_picture_of_the_models_name_that_no_material_names_is_told(tmp_path: Path) -> None:
    faces = "mtllib thing.mtl\n" + QUAD + "usemtl a\nf 1/1 2/2 3/3\n"
    for at, (mtl, names, said) in enumerate((
        ("newmtl a\nKd 0.8 0.8 0.8\n", ("thing_diffuse.png", "thing_normal.png"), True),
        ("newmtl a\nKd 0.8 0.8 0.8\n", ("thing_normal.png", "other.png"), False),
        ("newmtl a\nmap_Kd other.png\n", ("thing_diffuse.png", "other.png"), False),
        ("newmtl a\nmap_Kd gone.png\n", ("thing_diffuse.png",), False),
    )):  # fmt: skip
        source = write_model(tmp_path / f"m{at}", faces, mtl, *names)
        told = [note for note in new_scene(tmp_path / f"s{at}", source).notes if "colour map" in note]
        assert len(told) == said, told
        assert not said or "its materials name no picture" in told[0]
        assert not said or 'write color = "thing_diffuse.png" under [[object]]' in told[0]


def test_a_model_with_several_maps_stays_one_object_with_a_map_for_each_material(tmp_path: Path) -> None:
    faces = "".join(
        f"{use}f 1/1 2/2 \\\n 3/3\n"
        for use in ("", "usemtl a\n", "usemtl b\n", "usemtl bare\n", "usemtl a\n")
    )
    mtl = "newmtl a\nmap_Kd a.png\nnewmtl b\nmap_Kd b.png\nnewmtl bare\nKd 1 0 0\n"
    source = write_model(tmp_path / "m", "mtllib thing.mtl\n" + QUAD + faces, mtl, "a.png", "b.png")
    made = new_scene(tmp_path / "s", source)
    (item,) = load_scene(made.scene).objects
    assert len(read_obj(item.mesh).mesh.triangles) == len(read_obj(source).mesh.triangles) == 5
    report = bake(made.scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not report.errors
    maps = {one.name for one in report.artifacts}
    assert {"thing_a_color", "thing_b_color"} <= maps
    assert not any(name.startswith("thing_bare") for name in maps)


@pytest.mark.parametrize(
    ("size", "suffix"),
    sweep([(1.0, "STL"), (2000.0, "STL"), (1.0, "ply"), (1.0, "obj")], test=[(2000.0, "STL"), (1.0, "obj")]),
)
def test_the_lines_beside_an_obj_stl_or_ply_turn_a_model_whose_z_is_up_upright(
    tmp_path: Path, size: float, suffix: str
) -> None:
    low, high = size * np.array([5.0, 7.0, 1.0]), size * np.array([7.0, 7.5, 4.0])
    corners = [low, [high[0], low[1], low[2]], [low[0], high[1], high[2]], high]
    loops = "".join(
        "outer loop\n" + "".join("vertex {} {} {}\n".format(*corners[k]) for k in loop) + "endloop\n"
        for loop in ((0, 1, 3), (0, 3, 2))
    )
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    rows = "".join("{} {} {}\n".format(*corner) for corner in corners) + "3 0 1 3\n3 0 3 2\n"
    places = "".join("v {} {} {}\n".format(*corner) for corner in corners)
    texts = {
        "STL": f"solid post\n{loops}endsolid post\n",
        "ply": head + rows,
        "obj": places + "f 1 2 4\nf 1 4 3\n",
    }
    (tmp_path / f"Post.{suffix}").write_text(texts[suffix])
    new = new_scene(tmp_path / "s", tmp_path / f"Post.{suffix}")
    text = new.scene.read_text()
    pattern = r"(position = .*)\n(?:scale.*\n)?# The file .*\n# (position.*)\n# (pitch.*)"
    ((given, line, turn),) = re.findall(pattern, text)
    new.scene.write_text(text.replace(given, f"{line}\n{turn}", 1))
    (instance,) = load_scene(new.scene).objects[0].instances
    places = np.array([to_world(corner, placed(instance)) for corner in (low, high)])
    assert np.allclose(np.ptp(places, axis=0), new.scale * size * np.array([2.0, 3.0, 0.5]))
    assert places[1, 1] > places[0, 1] == pytest.approx(0.0, abs=0.05 * size * new.scale)
    assert np.allclose(places.mean(axis=0)[[0, 2]], 0.0, atol=1e-4 * size)
    assert "names no axis" not in new_scene(tmp_path / "t").scene.read_text()


def test_what_is_there_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    with pytest.raises(BakeError, match="not empty"):
        new_scene(tmp_path / "full")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(BakeError, match="is a file"):
        new_scene(tmp_path / "file")
    (tmp_path / "empty").mkdir()
    assert load_scene(new_scene(tmp_path / "empty").scene).head.name == "empty"


def test_a_full_disk_is_told_with_its_mend_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(BakeError, match="No space left on device; free space there, or name another folder"):
        new_scene(tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_a_model_given_as_the_folder_is_told_how_to_start_from_it(tmp_path: Path) -> None:
    (tmp_path / "my rock.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(BakeError, match="is a file, not a folder") as caught:
        new_scene(tmp_path / "my rock.obj")
    assert "--from" in str(caught.value.mend) and "name a new folder" in str(caught.value.mend)


@pytest.mark.parametrize(
    ("size", "offset", "words"), [(1e-12, 0.0, "scale"), (1e20, 0.0, "scale"), (1.0, 1e10, "move")]
)
def test_a_model_beyond_what_a_scene_can_show_is_refused(
    tmp_path: Path, size: float, offset: float, words: str
) -> None:
    corners = [(0.0, 0.0), (size, 0.0), (0.0, size)]
    text = "".join(f"v {x + offset!r} {y + offset!r} {offset!r}\n" for x, y in corners)
    with pytest.raises(SourceError, match=words):
        new_scene(tmp_path / "s", write_model(tmp_path / "m", text + "f 1 2 3\n", ""))
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        ("v 0 0 0\nv 1.5e7 0 0\nv 0 1.5e7 0\n", r"radius is 1\.06066e\+07 metres.* up to 1e\+07.*scale"),
        ("v 9e6 0 0\nv 1.1e7 0 0\nv 9e6 1e6 0\n", r"coordinate is 1\.1e\+07 metres.* up to 1e\+07.*nearer"),
    ],
)
def test_a_mesh_that_the_player_would_not_take_is_refused_with_its_limit(
    tmp_path: Path, corners: str, words: str
) -> None:
    with pytest.raises(SourceError, match=words):
        new_scene(tmp_path / "s", write_model(tmp_path / "m", corners + "f 1 2 3\n", ""))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_model_that_lies_far_along_one_axis_is_refused(tmp_path: Path, axis: int) -> None:
    corners = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    corners[:, axis] -= 1e10
    text = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in corners.tolist())
    with pytest.raises(SourceError, match="move"):
        new_scene(tmp_path / "s", write_model(tmp_path / "m", text + "f 1 2 3\n", ""))


def test_a_model_that_cannot_be_read_leaves_nothing(tmp_path: Path) -> None:
    bad = tmp_path / "bad.obj"
    bad.write_text("v 0 0 nan\n")
    with pytest.raises(SourceError, match=r"bad\.obj"):
        new_scene(tmp_path / "s", bad)
    assert {path.name for path in tmp_path.iterdir()} == {"bad.obj"}


@pytest.mark.parametrize("name", ["terrain.obj", "ÄÖÜ.obj", "1 2.obj", "x" * 60 + ".obj"])
def test_names_that_no_object_may_have_are_changed(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    scene: Scene = load_scene(new_scene(tmp_path / f"scene {name[:10]}", tmp_path / name).scene)
    assert scene.objects[0].name and not set(scene.objects[0].name) - set(
        "abcdefghijklmnopqrstuvwxyz0123456789_"
    )


@pytest.mark.deep
def test_models_of_kits_become_scenes_that_bake(sources: Path, tmp_path: Path) -> None:
    models = sorted((sources / "obj-kits").rglob("*.obj"))
    models = models[:: max(1, len(models) // 6)]
    assert len(models) > 5
    for i, model in enumerate(models):
        made = new_scene(tmp_path / f"s{i}", model)
        report = bake(made.scene, tmp_path / f"out{i}", BuildOptions(jobs=1))
        assert not report.errors, (model, report.errors)


def test_maps_repeat_where_the_layout_is_wider_than_the_picture(tmp_path: Path) -> None:
    obj = ball().replace("mtllib post.mtl", "mtllib thing.mtl")
    source = write_model(tmp_path / "m", obj, "newmtl wood\nmap_Kd a.png\n", "a.png")
    wide = write_model(
        tmp_path / "w", obj.replace("vt 1.000000", "vt 2.5"), "newmtl wood\nmap_Kd a.png\n", "a.png"
    )
    for name, model, wrap in (("s", source, None), ("t", wide, REPEATED)):
        scene = new_scene(tmp_path / name, model).scene
        assert {one.wrap for one in find_map_sets(load_scene(scene), scene).maps.sets} == {wrap}


def test_a_model_whose_name_is_no_text_is_refused(tmp_path: Path) -> None:
    name = os.fsdecode(b"\xff.obj")
    (tmp_path / name).write_text(QUAD + "f 1 2 3\n")
    with pytest.raises(SourceError, match="the file's name is not UTF-8; rename it"):
        new_scene(tmp_path / "mine", tmp_path / name)
    assert not (tmp_path / "mine").exists()
