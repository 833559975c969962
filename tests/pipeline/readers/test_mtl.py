"""MTL: every statement reaches the record of the material, or a warning."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.data import Image
from paradize.errors import GroupedError, SourceError
from paradize.formats.png import encode_png
from paradize.material import Material
from paradize.readers import obj as obj_module
from paradize.readers.mtl import maps, read_mtl
from paradize.readers.mtl import read as statements
from paradize.readers.mtl.bump import bump_of
from paradize.readers.mtl.phong import roughness_of, specular_of
from paradize.readers.obj import read_obj
from paradize.readers.record import Model
from tests.pipeline.readers.gltf.made import PNG
from tests.pipeline.readers.test_obj import TRIANGLE, read
from tests.sweeps import tries


def model(folder: Path, library: str, text: str = "newmtl wood\nKd 0.5 0.25 1\n") -> Model:
    (folder / "a.mtl").write_text(text)
    return read(folder, f"mtllib {library}\n" + TRIANGLE + "usemtl wood\nf 1 2 3\n")


def test_materials_are_read_with_their_maps(tmp_path: Path) -> None:
    (tmp_path / "my bark.png").write_bytes(b"")
    text = "newmtl wood\r\n\tKd 0.5 0.25 1\r\nNs 10\r\nd 0.5\r\nmap_Kd -s 2 2 1 -o 0.1 my bark.png\r\n"
    result = model(tmp_path, "a.mtl", text)
    wood = result.materials["wood"]
    assert (wood.color, wood.opacity) == ((1.0, 1.0, 1.0), 0.5)
    assert wood.picture("color") == (tmp_path / "my bark.png").resolve()
    assert result.warnings == []


def test_the_only_material_is_used_where_no_line_chooses_one(tmp_path: Path) -> None:
    """It takes the name of the material of faces without one, which scenes may know already."""
    said = "its faces name no material that is defined; 'a', the only one, is used"
    for names, red in ((["a"], True), (["a", "b"], False), (["default"], True)):
        (tmp_path / "a.mtl").write_text("".join(f"newmtl {name}\nKd 1 0 0\n" for name in names))
        for line in ("", "usemtl default\n"):
            result = read(tmp_path, "mtllib a.mtl\n" + TRIANGLE + line + "f 1 2 3\n")
            assert [group.material for group in result.mesh.groups] == ["default"]
            default = result.materials.get("default")
            assert (default is not None and default.name == "default" and default.color == (1, 0, 0)) == red
            assert [w.partition(": ")[2] for w in result.warnings] == ([said] if names == ["a"] else [])


@pytest.mark.parametrize(("kd", "color"), [("0 0 0", (1, 1, 1)), ("0.5 0 0", (0.5, 0, 0))])
def test_black_in_place_of_a_picture_that_is_missing_is_not_drawn(
    tmp_path: Path, kd: str, color: tuple[float, ...]
) -> None:
    for lines in (f"Kd {kd}\nmap_Kd lost.png", f"map_Kd lost.png\nKd {kd}"):
        assert model(tmp_path, "a.mtl", f"newmtl wood\n{lines}\n").materials["wood"].color == color
    assert model(tmp_path, "a.mtl", "newmtl wood\nKd 0 0 0\n").materials["wood"].color == (0, 0, 0)


@pytest.mark.parametrize(
    ("line", "opacity"),
    [("d 0.25", 0.25), ("Tr 0.25", 0.75), ("d 7", 1.0), ("Tr 7", 1.0), ("d -halo 0.5", 0.5)],
)
def test_how_clear_a_material_is_may_be_told_either_way(tmp_path: Path, line: str, opacity: float) -> None:
    assert model(tmp_path, "a.mtl", f"newmtl wood\n{line}\nKd 0.5\n").materials["wood"].opacity == opacity


def test_library_names_may_hold_blanks_and_several_may_share_a_line(tmp_path: Path) -> None:
    (tmp_path / "one two.mtl").write_text("newmtl wood\n")
    (tmp_path / "three.mtl").write_text("newmtl stone\n")
    assert set(model(tmp_path, "one two.mtl").materials) == {"wood"}
    assert set(model(tmp_path, "three.mtl one two.mtl").materials) == {"wood", "stone"}


@pytest.mark.parametrize(
    ("used", "defined"),
    [
        ("材質".encode("shift_jis"), "材質".encode("shift_jis")),
        ("Grün".encode(), "Grün".encode()),
        (b"no\xa0break", b"no\xa0break"),
        (b"two\tparts", b"two\tparts"),
    ],
)
@pytest.mark.parametrize("comment", [b"", "# Größe".encode("latin-1"), "# Größe".encode()])
def test_names_in_any_encoding_are_the_same_in_both_files(
    tmp_path: Path, used: bytes, defined: bytes, comment: bytes
) -> None:
    (tmp_path / "a.mtl").write_bytes(comment + b"\nnewmtl " + defined + b"\nKd 1 0 0\n")
    text = b"mtllib a.mtl\n" + TRIANGLE.encode() + b"usemtl " + used + b"\nf 1 2 3\n"
    (tmp_path / "a.obj").write_bytes(text)
    result = read_obj(tmp_path / "a.obj")
    assert result.materials[result.mesh.groups[0].material].color == (1.0, 0.0, 0.0)
    assert result.warnings == []


@pytest.mark.parametrize(
    "name", ["../../out.png", "/etc/passwd", "C:\\tex\\a.png", "a/../../../out.png", "link.png"]
)
def test_a_map_outside_the_root_is_never_used(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "models/model"
    folder.mkdir(parents=True)
    (tmp_path / "out.png").write_bytes(b"")
    (folder / "link.png").symlink_to(tmp_path / "out.png")
    result = model(folder, "a.mtl", f"newmtl wood\nmap_Kd {name}\n")
    assert result.materials["wood"].picture("color") is None
    assert any("lies outside" in warning for warning in result.warnings)


@pytest.mark.parametrize(
    "name", ["C:\\Users\\me\\wood.png", "/home/me/wood.png", "C:/me/wood.png", "\\\\server\\me\\wood.png"]
)
def test_a_path_of_another_machine_means_the_picture_beside_the_file(tmp_path: Path, name: str) -> None:
    (tmp_path / "wood.png").write_bytes(b"")
    result = model(tmp_path, "a.mtl", f"newmtl wood\nmap_Kd {name}\n")
    assert result.materials["wood"].picture("color") == (tmp_path / "wood.png").resolve()
    assert any("is a path of another machine; 'wood.png' beside" in warning for warning in result.warnings)


def test_options_behind_the_name_are_read_as_maya_writes_them(tmp_path: Path) -> None:
    for name in ("a b.png", "c -s d.png"):
        (tmp_path / name).write_bytes(b"")
    text = "newmtl wood\nmap_Ks -imfchan r a b.png -clamp on\nmap_Kd c -s d.png\nmap_Ns gone.png -bm 1\n"
    result = model(tmp_path, "a.mtl", text)
    maps = result.materials["wood"].maps
    assert (maps["specular"].channel, maps["specular"].wrap) == ("r", ("clamp", "clamp"))
    assert maps["specular"].picture.file.name == "a b.png" and maps["color"].picture.file.name == "c -s d.png"
    assert any("'gone.png -bm 1' does not exist" in text for text in result.warnings)


def test_a_map_of_occlusion_is_read_and_a_map_of_ambient_light_like_the_colour_is_no_news(
    tmp_path: Path,
) -> None:
    (tmp_path / "a.png").write_bytes(b"")
    text = "newmtl wood\nmap_Ka a.png\nmap_Kd a.png\nmap_AO a.png\nnewmtl tin\nmap_Ka a.png\n"
    result = model(tmp_path, "a.mtl", text)
    assert result.materials["wood"].maps["occlusion"].channel == "luminance"
    (said,) = [warning for warning in result.warnings if "map_Ka" in warning]
    assert "map_Ka (line 6:" in said


def test_a_map_in_the_folder_above_is_used_unless_a_root_says_otherwise(tmp_path: Path) -> None:
    folder = tmp_path / "model"
    (tmp_path / "textures").mkdir()
    folder.mkdir()
    (tmp_path / "textures/a.png").write_bytes(b"")
    result = model(folder, "a.mtl", "newmtl wood\nmap_Kd ../textures/a.png\n")
    assert result.materials["wood"].picture("color") == (tmp_path / "textures/a.png").resolve()
    inside = read_obj(folder / "a.obj", root=folder)
    assert not inside.materials["wood"].maps and any("lies outside" in text for text in inside.warnings)


def test_a_root_above_the_folder_lets_maps_be_shared(tmp_path: Path) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    (tmp_path / "out.png").write_bytes(b"")
    (folder / "a.mtl").write_text("newmtl wood\nmap_Kd ..\\out.png\n")
    (folder / "a.obj").write_text("mtllib a.mtl\n" + TRIANGLE + "usemtl wood\nf 1 2 3\n")
    found = read_obj(folder / "a.obj", root=tmp_path)
    assert found.materials["wood"].picture("color") == (tmp_path / "out.png").resolve()


def test_one_library_named_often_is_looked_for_once(tmp_path: Path) -> None:
    found = read(tmp_path, "mtllib gone.mtl gone.mtl\n" * 50_000 + TRIANGLE + "f 1 2 3\n")
    assert sum("gone.mtl" in text for text in found.warnings) == 1


def test_a_name_without_end_does_not_fill_the_screen(tmp_path: Path) -> None:
    name = "x" * 100_000
    found = read(tmp_path, TRIANGLE + f"g {name}\nusemtl {name}\nmtllib {name}\n{name} 1\nf 1 2 3\n")
    assert len(found.warnings) >= 3 and max(map(len, found.warnings)) < 1000
    assert found.mesh.groups[0].material == name


def test_more_libraries_than_anyone_has_are_told_not_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(obj_module, "MAX_LIBRARIES", 20)
    text = "".join(f"mtllib gone{at}.mtl\n" for at in range(100))
    found = read(tmp_path, text + TRIANGLE + "f 1 2 3\n")
    assert len(found.warnings) < 60 and any("the rest is left out" in said for said in found.warnings)


def test_missing_libraries_maps_and_materials_are_told(tmp_path: Path) -> None:
    result = model(tmp_path, "gone.mtl a.mtl", "newmtl stone\nmap_Kd gone.png\n")
    message = " ".join(result.warnings)
    for part in ("'gone.mtl' does not exist", "'gone.png' does not exist", "'wood'"):
        assert part in message


def test_of_many_materials_that_are_not_defined_eight_are_named(tmp_path: Path) -> None:
    faces = "".join(f"usemtl stone{at}\nf 1 2 3\n" for at in range(9))
    (said,) = (text for text in read(tmp_path, TRIANGLE + faces).warnings if "not defined" in text)
    assert "9 materials are used but not defined: 'stone0'" in said
    assert "'stone7', ...;" in said and "'stone8'" not in said


@pytest.mark.parametrize(
    "line", ["Kd red", "Kd 1 nan 0", "Ks 1 2", "Kd 0.5 1_0 0", "Ns inf", "d 1e999", "Tr -halo x", "Ns"]
)
def test_a_bad_number_in_a_material_is_an_error_with_file_and_line(tmp_path: Path, line: str) -> None:
    with pytest.raises(SourceError, match=r"a\.mtl: line 3: .*, expected .*finite number"):
        model(tmp_path, "a.mtl", f"newmtl wood\n# fine\n{line}\n")


def test_all_bad_numbers_of_a_material_file_are_told_together(tmp_path: Path) -> None:
    with pytest.raises(GroupedError) as caught:
        model(tmp_path, "a.mtl", "newmtl wood\nKd red\nKs 0 0 0\nNs -inf\n")
    assert [error.place for error in caught.value.errors] == ["line 2", "line 4"]


def test_a_material_that_is_not_rgb_is_told_and_left_out(tmp_path: Path) -> None:
    result = model(tmp_path, "a.mtl", "newmtl wood\nKd xyz 1 1 1\nKs spectral a.rfl\n")
    assert sum("is not read" in text for text in result.warnings) == 2


@given(st.binary(max_size=200))
@settings(max_examples=tries(100), deadline=None)
def test_any_material_file_leaves_the_mesh_whole(
    tmp_path_factory: pytest.TempPathFactory, text: bytes
) -> None:
    folder = tmp_path_factory.getbasetemp()
    """Or is an error with its line, never anything else."""
    (folder / "a.mtl").write_bytes(b"newmtl wood\n" + text)
    try:
        assert len(read(folder, "mtllib a.mtl\n" + TRIANGLE + "f 1 2 3\n").mesh.triangles) == 1
    except (SourceError, GroupedError) as error:
        assert "a.mtl: line " in str(error)


def test_a_material_file_of_any_length_is_followed_a_bounded_number_of_times(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Options of one map, map statements, warnings and errors: each has its limit."""
    looked: list[Path] = []
    monkeypatch.setattr(maps, "named_file", lambda path, *_: bool(looked.append(path)))
    numbers: list[str] = []
    real = maps.floats
    monkeypatch.setattr(statements, "MAX_MAPS", 120)  # more than messages
    monkeypatch.setattr(maps, "floats", lambda text, count: numbers.append(text) or real(text, count))
    path = tmp_path / "a.mtl"
    path.write_text("newmtl a\nmap_Kd " + "-o 1 1 1 " * 100_000 + "a.png\n")
    wood = read_mtl(path, tmp_path).materials["a"]
    assert wood.picture("color") is None and len(numbers) < 100
    path.write_text("newmtl a\n" + "map_Kd gone.png\n" * 50_000)
    looked.clear()
    warnings = read_mtl(path, tmp_path).warnings
    assert len(looked) == statements.MAX_MAPS and len(warnings) == statements.MAX_MESSAGES + 2
    assert "more than 120 maps: this and all that follows is ignored" in warnings[-1]
    path.write_text("newmtl a\n" + "Kd x\n" * 50_000)
    with pytest.raises(GroupedError) as caught:
        read_mtl(path, tmp_path)
    assert len(caught.value.errors) == statements.MAX_MESSAGES


def test_options_before_a_maps_name_are_skipped_and_its_blanks_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.mtl"
    for name in ("a.png", "a  b.png"):
        (tmp_path / name).write_bytes(b"")
    every = " ".join(f"{option} {'1 ' * most}" for option, most in maps.OPTIONS.items())
    for text, name in ((f"{every} a.png", "a.png"), ("a  b.png", "a  b.png"), ("-bm 1 a.png", "a.png")):
        path.write_text(f"newmtl a\nmap_Kd {text}\n")
        assert read_mtl(path, tmp_path).materials["a"].picture("color") == tmp_path / name, text


def test_a_material_file_that_is_too_large_is_refused_with_its_own_limit(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with (tmp_path / "a.mtl").open("wb") as file:
        file.truncate(8 << 30)
    with pytest.raises(SourceError, match=f"a.mtl: .*holds {8 << 30} bytes, limit {statements.MAX_BYTES};"):
        read_obj(tmp_path / "a.obj")


def test_a_statement_of_many_material_files_looks_for_a_bounded_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked: list[Path] = []
    monkeypatch.setattr(obj_module, "named_file", lambda path, *_: bool(looked.append(path)))
    (tmp_path / "a.obj").write_text("mtllib " + "a.mtl " * 5000 + "\n" + TRIANGLE + "f 1 2 3\n")
    read_obj(tmp_path / "a.obj")
    assert len(looked) < 200


def one(folder: Path, text: str, *pictures: str) -> tuple[Material, list[str]]:
    """A material with these statements beside empty pictures, and the warnings of its file."""
    for name in pictures:
        (folder / name).write_bytes(b"")
    (folder / "one.mtl").write_text(text if "newmtl" in text else f"newmtl a\n{text}\n")
    library = read_mtl(folder / "one.mtl", folder)
    return library.materials["a"], library.warnings


@pytest.mark.parametrize(
    ("statement", "role"),
    [
        ("map_Kd", "color"), ("map_d", "alpha"), ("norm", "normal"), ("map_Kn", "normal"),
        ("map_norm", "normal"), ("map_Normal", "normal"),
        ("map_Bump", "height"), ("bump", "height"), ("disp", "height"), ("map_disp", "height"),
        ("map_Pr", "roughness"), ("map_Ns", "smoothness"), ("map_Pm", "metalness"), ("map_Ks", "specular"),
        ("map_Ke", "emission"), ("map_emissive", "emission"),
    ],
)  # fmt: skip
def test_every_map_statement_reaches_its_role(tmp_path: Path, statement: str, role: str) -> None:
    material, warnings = one(tmp_path, f"{statement} a.png", "a.png")
    assert {key: source.picture.file.name for key, source in material.maps.items()} == {role: "a.png"}
    assert warnings == []


@pytest.mark.parametrize(
    ("statement", "channels"),
    [
        ("map_ORM", {"occlusion": "r", "roughness": "g", "metalness": "b"}),
        ("map_RMA", {"occlusion": "b", "roughness": "r", "metalness": "g"}),
    ],
)
def test_a_packed_picture_is_a_map_in_each_channel(
    tmp_path: Path, statement: str, channels: dict[str, str]
) -> None:
    material, warnings = one(tmp_path, f"{statement} a.png", "a.png")
    assert {role: source.channel for role, source in material.maps.items()} == channels and not warnings
    material, warnings = one(tmp_path, f"map_Pr r.png\n{statement} a.png", "a.png", "r.png")
    assert material.maps["roughness"].picture.file.name == "r.png"
    assert len(warnings) == 1 and "line 2 names this material's roughness already" in warnings[0]


@pytest.mark.parametrize(
    ("text", "opacity", "told"),
    [
        ("newmtl a\nTr 1", 1.0, "Tr 1 would hide the material; read as opaque"),
        ("# Converted by Meshlab Group\nnewmtl a\nTr 1.0", 1.0, ""),
        ("# Converted by Meshlab Group\nnewmtl a\nTr 0.25", 0.25, ""),
        ("newmtl a\nd 0", 0.0, "d 0: the material is wholly clear and does not show; d 1 shows it"),
    ],
)
def test_no_material_vanishes_without_a_word(tmp_path: Path, text: str, opacity: float, told: str) -> None:
    material, warnings = one(tmp_path, text)
    assert material.opacity == opacity
    assert told in " ".join(warnings) and bool(told) == bool(warnings)


def test_factors_reach_the_record_in_gltfs_terms(tmp_path: Path) -> None:
    material, warnings = one(tmp_path, "Kd 1 0.5 0\nKe 2 0 0.5\nd 0.25\nPr 0.75\nPm 0.5\nKs 0.04 0.04 0.04")
    assert (material.color, material.emission, material.opacity) == ((1, 0.5, 0), (2, 0, 0.5), 0.25)
    assert (material.roughness, material.metalness, material.alpha_mode) == (0.75, 0.5, "blend")
    assert material.specular == pytest.approx(1.0)
    assert warnings == []


def test_an_exponent_becomes_the_roughness_whose_highlight_falls_off_alike() -> None:
    """Beckmann's slope distribution against cos^n, both by their width at half the peak."""
    for exponent in (100.0, 1000.0, 10000.0):
        alpha = roughness_of(exponent, blender=False) ** 2
        half = np.arccos(0.5 ** (1 / exponent))
        assert np.exp(-(np.tan(half) ** 2) / alpha**2) / np.cos(half) ** 4 == pytest.approx(0.5, abs=0.02)
    assert roughness_of(0.0, blender=False) == 1.0 and roughness_of(-3.0, blender=False) == 1.0


def test_a_highlight_keeps_its_peak_where_the_exponent_rises() -> None:
    assert specular_of((0.5,) * 3, 92.0, kd=1.0) == pytest.approx(1.0)
    assert specular_of((0.04,) * 3, None, kd=1.0) == pytest.approx(1.0)


@pytest.mark.parametrize("more", ["", "Ns 0", "Ns 5", "illum 2"])
def test_a_highlight_of_phong_makes_no_mirror_of_a_coloured_surface(tmp_path: Path, more: str) -> None:
    """Files of many programs say Ks 1 of wood, and Ns 0; glTF's light would have it reflect the whole sky."""
    for color in ("Kd 0.8 0.2 0.1", "map_Kd a.png\nKd 0 0 0"):
        material, _ = one(tmp_path, f"{color}\nKs 1 1 1\n{more}", "a.png")
        assert material.specular == pytest.approx(0.08 / 0.04)


def test_what_reflects_and_has_no_colour_is_a_metal_of_phong(tmp_path: Path) -> None:
    assert one(tmp_path, "Kd 0 0 0\nKs 0.9 0.9 0.6")[0].specular == pytest.approx(0.8 / 0.04)
    assert one(tmp_path, "Kd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nPr 0.2")[0].specular == pytest.approx(0.5 / 0.04)


@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.5, 1.0])
def test_what_blender_wrote_is_read_as_blender_meant_it(tmp_path: Path, roughness: float) -> None:
    text = f"# Blender 4.2.0 MTL File: 'None'\nnewmtl a\nNs {1000 * (1 - roughness) ** 2}\nKs 0.5 0.5 0.5\n"
    text += "Ka 0.25 0.25 0.25\nillum 3\nmap_Bump b.png\n"
    material, warnings = one(tmp_path, text, "b.png")
    assert material.roughness == pytest.approx(roughness)
    assert (material.specular, material.metalness, [*material.maps]) == (1.0, 0.25, ["normal"])
    material, more = one(tmp_path, text + "map_Ns -imfchan g r.png\nmap_refl -imfchan b r.png\n", "r.png")
    assert (material.maps["roughness"].channel, material.maps["metalness"].channel) == ("g", "b")
    assert material.metalness is None and warnings == more == []


def test_a_map_replaces_the_factor_beside_it(tmp_path: Path) -> None:
    text = "Kd 0 0 0\nKe 0 0 0\nNs 10\nPm 0\nd 0.5\nKs 0 0 0\n"
    text += "".join(f"{word} a.png\n" for word in ("map_Kd", "map_Ke", "map_Ns", "map_Pm", "map_d", "map_Ks"))
    material, _ = one(tmp_path, text, "a.png")
    assert (material.color, material.emission, material.opacity) == ((1, 1, 1), (1, 1, 1), 1.0)
    assert (material.roughness, material.metalness, material.specular) == (None, None, None)


def test_light_without_highlights_has_none(tmp_path: Path) -> None:
    assert one(tmp_path, "Ks 1 1 1\nillum 1")[0].specular == 0.0
    assert one(tmp_path, "Ks 1 1 1\nillum 2")[0].specular != 0.0


def test_options_reach_the_map(tmp_path: Path) -> None:
    text = "map_Kd -clamp on a.png\nmap_Pr -imfchan g a.png\nmap_d a.png\nnorm -bm 0.5 n.png"
    text += "\ndisp -bm -2 h.png"
    material, warnings = one(tmp_path, text, "a.png", "n.png", "h.png")
    assert material.maps["color"].wrap == ("clamp", "clamp") and material.maps["normal"].wrap is None
    assert material.maps["roughness"].channel == "g"
    assert material.maps["alpha"].channel == "a"  # the picture of the colour holds it
    assert (material.normal_scale, material.bump_m, material.maps["height"].inverted) == (0.5, 2.0, True)
    assert warnings == []


def test_what_is_not_used_is_one_warning_that_names_it(tmp_path: Path) -> None:
    text = "Ka 0.2 0.2 0.2\nNi 1.3\nillum 4\nPs 0.5\nwobble 3\nmap_Ka b.png\nrefl -type sphere s.png\n"
    text += "map_Kd -cc on -boost 2 a.png\nnewmtl b\nKa 0.5 0 0\n"
    _, warnings = one(tmp_path, f"newmtl a\n{text}", "a.png", "b.png", "s.png")
    assert len(warnings) == 1
    for part in (
        *("Ka (2 times, first in line 2: ambient light", "Ni (line 3: ", "illum (line 4: ", "Ps (line 5: "),
        *(
            "wobble (line 6: unknown)",
            "map_Ka (line 7: ",
            "refl (line 8: ",
            "-cc (line 9: ",
            "-boost (line 9: ",
        ),
    ):
        assert part in warnings[0]


def test_what_changes_nothing_is_not_told(tmp_path: Path) -> None:
    text = "Ka 1 1 1\nNi 1.45\nillum 2\nTf 1 1 1\nPs 0\nmap_Kd -blendu on -cc off a.png\nmap_Ka a.png\n"
    assert one(tmp_path, text, "a.png")[1] == []  # map_Ka: the colour is the ambient light's too


def test_maps_beyond_one_of_a_role_are_told(tmp_path: Path) -> None:
    material, warnings = one(tmp_path, "disp d.png\nbump b.png\nmap_Pr r.png\nmap_Ns s.png", "d.png",
                             "b.png", "r.png", "s.png")  # fmt: skip
    assert material.picture("height") == (tmp_path / "b.png").resolve()
    assert [text.partition(": line ")[2] for text in warnings] == [
        "2: disp: line 3 names this material's height already; ignored",
        "5: map_ns: line 4 names this material's roughness already; ignored",
    ]


def test_a_material_without_a_name_is_told(tmp_path: Path) -> None:
    result = model(tmp_path, "a.mtl", "newmtl wood\nKd 1 0 0\nnewmtl\nKd 0 1 0\n")
    assert result.materials["wood"].color == (1.0, 0.0, 0.0)
    assert [text.partition(": line ")[2] for text in result.warnings] == [
        "3: a material without a name, which no face can use; name it"
    ]


def test_a_map_that_is_named_twice_is_told_and_the_last_one_counts(tmp_path: Path) -> None:
    text = "map_Kd a.png\nmap_Kd b.png\nmap_Kd b.png\nmap_Pr a.png\nmap_Kd -s 2 2 b.png"
    material, warnings = one(tmp_path, text, "a.png", "b.png")
    assert material.picture("color") == (tmp_path / "b.png").resolve()
    assert [text.partition(": line ")[2] for text in warnings] == [
        "3: map_Kd: line 2 says otherwise; the last one counts",
        "6: map_Kd: line 4 says otherwise; the last one counts",
    ]


def vectors(rng: np.random.Generator, tilt: float) -> np.ndarray:
    """Texels of random directions within a cone out of the surface."""
    xy = rng.uniform(-tilt, tilt, (64, 64, 2))
    z = np.sqrt(1 - (xy**2).sum(axis=2, keepdims=True))
    return np.rint((np.concatenate([xy, z], axis=2) + 1) * 127.5).astype(np.uint8)


def image(texels: np.ndarray) -> Image:
    return Image(texels, "srgb", 8, 255)


@pytest.mark.parametrize("tilt", [0.0, 0.1, 0.6])
def test_a_normal_map_is_known_by_its_texels(tilt: float) -> None:
    texels = vectors(np.random.default_rng(1), tilt)
    assert bump_of(image(texels)) == "normal"
    texels[:48] = 0  # nothing between the parts of a layout
    assert bump_of(image(texels)) == "normal"


@pytest.mark.parametrize("length", [0.45, 0.7])
def test_so_is_one_whose_vectors_a_strength_has_shortened(length: float) -> None:
    texels = vectors(np.random.default_rng(1), 0.6)
    texels = np.rint(127.5 + (texels - 127.5) * length).astype(np.uint8)
    assert bump_of(image(texels)) == "normal"
    assert bump_of(image(texels[:, :, ::-1])) == "unclear", "they lean"


@pytest.mark.parametrize("color", [(120, 125, 170), (128, 128, 200)])
def test_a_bluish_picture_is_no_normal_map(color: tuple[int, int, int]) -> None:
    light = np.random.default_rng(3).uniform(0.85, 1.15, (64, 64, 1))
    assert bump_of(image(np.rint(np.array(color) * light).clip(0, 255).astype(np.uint8))) == "unclear"
    assert bump_of(image(np.full((64, 64, 3), color, np.uint8))) == "unclear"


def test_heights_and_pictures_are_no_normal_maps() -> None:
    rng = np.random.default_rng(2)
    grey = rng.integers(0, 256, (64, 64, 1), dtype=np.uint8)
    assert bump_of(image(grey)) == "height" and bump_of(image(np.repeat(grey, 3, axis=2))) == "height"
    assert bump_of(image(rng.integers(0, 256, (64, 64, 3), dtype=np.uint8))) == "unclear"
    sky = np.full((64, 64, 3), (90, 140, 250), np.uint8) + rng.integers(0, 6, (64, 64, 3), dtype=np.uint8)
    assert bump_of(image(sky)) == "unclear"
    around = vectors(rng, 0.6)
    around[::2, :, 2] = 255 - around[::2, :, 2]  # in the object's space
    assert bump_of(image(around)) == "unclear"


def test_a_bump_map_is_what_its_texels_say(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    (tmp_path / "wall.png").write_bytes(encode_png(vectors(rng, 0.5)))
    (tmp_path / "wall_n.png").write_bytes(encode_png(rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)))
    material, warnings = one(tmp_path, "map_Bump -bm 2 wall.png")
    assert ([*material.maps], material.normal_scale, material.bump_m, warnings) == (["normal"], 2.0, None, [])
    material, warnings = one(tmp_path, "map_Bump wall_n.png")
    assert not material.maps and "is named like a normal map" in warnings[0]
    material, warnings = one(tmp_path, "map_Bump -imfchan r wall.png")
    assert material.maps["height"].channel == "r"


def test_a_bump_map_that_blender_named_and_that_holds_no_normals_gives_heights(tmp_path: Path) -> None:
    """Versions before 2.8 wrote any picture of bumps so; as a normal map the model would be refused."""
    rng = np.random.default_rng(4)
    (tmp_path / "rock.png").write_bytes(encode_png(rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)))
    material, warnings = one(tmp_path, "# Blender MTL File: 'a.blend'\nnewmtl a\nmap_Bump rock.png")
    assert ([*material.maps], warnings) == (["height"], [])
    (tmp_path / "wall.png").write_bytes(encode_png(vectors(rng, 0.5)))
    material, warnings = one(tmp_path, "# Blender 4.2.0 MTL File: 'None'\nnewmtl a\nmap_Bump wall.png")
    assert ([*material.maps], warnings) == (["normal"], [])


QUADS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n"
QUADS += "vt 0.25 0.5\nvt 0.5 0.5\nvt 0.5 0.75\nvt 0.25 0.75\n"
QUADS += "usemtl a\nf 1/1 2/2 3/3 4/4\nusemtl b\nf 2/2 5/1 6/4 3/3\n"


def test_scale_and_offset_move_the_texture_coordinates_of_their_material_alone(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"")
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd -s 2 4 -o 0.125 0.25 a.png\nnewmtl b\nmap_Kd a.png\n")
    plain = read(tmp_path, QUADS)
    moved = read(tmp_path, "mtllib m.mtl\n" + QUADS)
    assert plain.mesh.uvs is not None and moved.mesh.uvs is not None
    before, after = (model.mesh.uvs[model.mesh.triangles] for model in (plain, moved))  # type: ignore[index]
    u, v = before[:2, :, 0], 1 - before[:2, :, 1]
    assert np.allclose(after[:2], np.stack([2 * u + 0.125, 1 - (4 * v + 0.25)], axis=2), atol=1e-6)
    assert (after[2:] == before[2:]).all()
    corners = plain.mesh.absolute_positions[plain.mesh.triangles]
    assert (moved.mesh.absolute_positions[moved.mesh.triangles] == corners).all()
    assert (moved.source.positions == moved.mesh.absolute_positions).all()
    assert len(moved.mesh.positions) == len(plain.mesh.positions) + 2  # where the materials meet


@pytest.mark.parametrize(
    ("maps", "second", "told"),
    [
        ("map_Pr -s 3 3 b.png", ("roughness",), []),
        ("map_d -s 4 6 -o 0.5 0.25 b.png\nmap_Ks -s -4 2 b.png", (), []),  # drawn anew
        ("norm -s 4 6 b.png\nmap_Pr -s 3 3 b.png", ("roughness",), []),
        (
            "map_Pr -s 3 3 b.png\nmap_Pm -s 3 3 b.png\nmap_Ke -o 0.5 0 b.png",
            ("roughness", "metalness"),
            ["map_ke"],
        ),
        ("norm -s 4 1 b.png", ("normal",), []),
        ("norm -s -4 1 b.png", ("normal",), []),  # its frame is another
        ("norm -s -4 1 b.png\nmap_Pr -s 3 3 b.png", ("normal",), ["map_pr"]),
        ("map_Pr -s 3 3 b.png\nnorm -s -4 1 b.png", ("normal",), ["map_pr"]),
        ("map_d -s 3 3 b.png\nmap_Bump -imfchan l -s 3 3 b.png", (), ["map_d", "map_bump"]),
        ("map_Pr -s 3 3 b.png\nmap_Ks -s 2 2 b.png", (), ["map_pr"]),  # gloss lies in one place
        ("map_Pr -s 2 2 b.png", (), []),
    ],
)
def test_a_map_that_moves_otherwise_than_the_colour_lies_on_second_coordinates_or_is_told(
    maps: str, second: tuple[str, ...], told: list[str], tmp_path: Path
) -> None:
    found, warnings = one(tmp_path, f"newmtl a\nmap_Kd -s 2 2 a.png\n{maps}", "a.png", "b.png")
    assert set(found.second) == set(second)
    said = [text for text in warnings if "-s and -o differ from those of line 2" in text]
    assert len(said) == len(told)
    assert all(any(f"{keyword}: " in text for text in said) for keyword in told)


@pytest.mark.parametrize(
    ("width", "options", "placed"),
    [
        (1.0, "-s 3 2 1 -o 0.25 0.5", ((3.0, 0.25), (2.0, 0.5))),  # v upwards: 1 - (2 (1 - v) + 0.5)
        (4.0, "-s 3 2 1 -o 0.25 0.5", ((3.0, 0.25), (2.0, 0.5))),
        (1.0, "-s 0.5 1", ((0.5, 0.0), (1.0, 0.0))),
        (4.0, "-s 0.5 1", None),  # half a tile does not repeat with the colour
        (1.0, "-s -1 1 -clamp on", ((-1.0, 0.0), (1.0, 0.0))),
        (4.0, "-s -1 1 -clamp on", None),
        (1.0, "-s 1000 1", None),
    ],
)
def test_a_map_that_can_be_drawn_anew_for_the_colours_coordinates_says_how(
    width: float, options: str, placed: object, tmp_path: Path
) -> None:
    for name in ("a.png", "b.png"):
        (tmp_path / name).write_bytes(PNG)
    (tmp_path / "m.mtl").write_text(f"newmtl a\nmap_Kd a.png\nmap_d {options} b.png\n")
    corners = f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt {width} 0\nvt 0 1\n"
    (tmp_path / "m.obj").write_text(f"mtllib m.mtl\n{corners}usemtl a\nf 1/1 2/2 3/3\n")
    found = read_obj(tmp_path / "m.obj")
    assert found.materials["a"].maps["alpha"].placed == placed
    told = [text for text in found.warnings if "no whole number of its tiles" in text]
    assert len(told) == (placed is None)


def test_second_coordinates_are_those_of_their_maps(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        (tmp_path / name).write_bytes(PNG)
    text = "newmtl a\nmap_Kd -o 0.25 0 a.png\nmap_Ke -s 2 4 -o 0 0.5 b.png\nnewmtl b\nmap_Kd a.png\n"
    (tmp_path / "m.mtl").write_text(text)
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
    faces = "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 3/3 2/2 1/1\n"
    (tmp_path / "m.obj").write_text(f"mtllib m.mtl\n{corners}{faces}")
    mesh = read_obj(tmp_path / "m.obj").mesh
    assert mesh.uvs is not None and mesh.uvs1 is not None
    first, second = mesh.triangles
    assert mesh.uvs[first].tolist() == [[0.25, 1.0], [1.25, 1.0], [0.25, 0.0]]
    assert mesh.uvs1[first].tolist() == [[0.0, 0.5], [2.0, 0.5], [0.0, -3.5]]  # 1 - 4 v - 0.5 of v upwards
    assert mesh.uvs[second].tolist() == [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    assert not mesh.uvs1[second].any()


@pytest.mark.parametrize(
    ("statement", "key", "value"),
    [
        ("map_Pr -mm 0 0.5 b.png", "roughness", 0.5),
        ("map_Pm -mm 0 0.25 b.png", "metalness", 0.25),
        ("map_Ks -mm 0 0.5 b.png", "specular", 0.5),
        ("map_d -mm 0 0.5 b.png", "opacity", 0.5),
        ("map_AO -mm 0.25 0.75 b.png", "occlusion_strength", 0.75),
    ],
)
def test_the_gain_of_a_map_is_its_factor(statement: str, key: str, value: float, tmp_path: Path) -> None:
    found, warnings = one(tmp_path, f"newmtl a\n{statement}", "b.png")
    assert getattr(found, key) == value and not warnings


@pytest.mark.parametrize("option", ["-o nan 0", "-s inf 2", "-o wide", "-mm x 0.5", "-t nan"])
def test_an_option_of_numbers_that_are_none_is_named(option: str, tmp_path: Path) -> None:
    found, (text,) = one(tmp_path, f"newmtl a\nmap_Pr {option} b.png", "b.png")
    assert f"not used: {option.split()[0]} (line 2: the option has no effect)" in text
    assert found.roughness is None


@pytest.mark.parametrize(
    "statement", ["map_Kd -mm 0 0.5", "map_Pr -mm 0.5 0.5", "map_Pr -mm 0 2", "norm -mm 0 2"]
)
def test_a_gain_that_no_factor_stands_for_is_told_with_its_map(statement: str, tmp_path: Path) -> None:
    _, (text,) = one(tmp_path, f"newmtl a\n{statement} b.png", "b.png")
    keyword, _, rest = statement.partition(" ")
    assert f"line 2: {keyword.lower()}: {rest} of a map of " in text and "has no effect" in text


def test_a_later_library_replaces_how_a_material_moves(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"")
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd -s 2 2 a.png\n")
    (tmp_path / "n.mtl").write_text("newmtl a\nmap_Kd a.png\n")
    moved = read(tmp_path, "mtllib m.mtl\nmtllib n.mtl\n" + QUADS)
    assert (moved.mesh.uvs == read(tmp_path, QUADS).mesh.uvs).all()  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("line", "said", "field", "value"),
    [
        ("Kd 1e30 -1 0.5", "Kd 1e+30 -1 0.5, expected 0 to 1; read as 1 0 0.5", "color", (1.0, 0.0, 0.5)),
        (
            "Ke -1 2 1e30",
            "Ke -1 2 1e+30, expected 0 to 1e+07; read as 0 2 1e+07",
            "emission",
            (0.0, 2.0, 1e7),
        ),
        ("Ns -5", "Ns -5, expected 0 or more; read as 0", "roughness", 1.0),
        ("d 3", "d 3, expected 0 to 1; read as 1", "opacity", 1.0),
        ("Tr -3", "Tr -3, expected 0 to 1; read as 0", "opacity", 1.0),
        ("Pr 7", "Pr 7, expected 0 to 1; read as 1", "roughness", 1.0),
        ("Pm -7", "Pm -7, expected 0 to 1; read as 0", "metalness", 0.0),
        (
            "norm -bm 1e300 a.png",
            "norm: -bm 1e+300, expected -1e+06 to 1e+06; read as 1e+06",
            "normal_scale",
            1e6,
        ),
        (
            "map_disp -bm -7e9 a.png",
            "map_disp: -bm -7e+09, expected -1e+06 to 1e+06; read as -1e+06",
            "bump_m",
            1e6,
        ),
    ],
)
def test_a_number_out_of_its_range_is_read_as_the_nearest_in_it_and_told(
    tmp_path: Path, line: str, said: str, field: str, value: object
) -> None:
    (tmp_path / "a.png").write_bytes(PNG)
    found = model(tmp_path, "a.mtl", f"newmtl wood\n{line}\n")
    assert getattr(found.materials["wood"], field) == pytest.approx(value)
    assert found.warnings == [f"{tmp_path / 'a.mtl'}: line 2: {said}: correct it in the model"]


def test_a_number_that_rounding_took_out_of_its_range_is_not_told(tmp_path: Path) -> None:
    found = model(tmp_path, "a.mtl", "newmtl wood\nKd 1.000001 0.5 -0.000001\n")
    assert found.materials["wood"].color == (1.0, 0.5, 0.0)
    assert not found.warnings


@pytest.mark.parametrize("name", ["model://suv/textures/wheels.png", "https://example.com/wheels.png"])
def test_a_picture_of_a_web_or_robot_address_is_to_be_copied(tmp_path: Path, name: str) -> None:
    library = f"newmtl wood\nmap_Kd {name}\n"
    (said,) = model(tmp_path, "a.mtl", library).warnings
    advice = "copy the picture beside the material file"
    assert said.endswith(f"line 2: map_Kd: {name!r} is not followed; ignored: {advice}")
    (tmp_path / "wheels.png").write_bytes(PNG)
    (said,) = model(tmp_path, "a.mtl", library).warnings
    assert said.endswith("'wheels.png' is read instead")


def test_texture_coordinates_that_move_beyond_any_tile_stay_finite_and_are_told(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(PNG)
    (tmp_path / "a.mtl").write_text("newmtl wood\nmap_Kd -s 1e300 1 a.png\n")
    found = read(tmp_path, "mtllib a.mtl\n" + TRIANGLE + "vt 1 0\nusemtl wood\nf 1/1 2/1 3/1\n")
    assert found.mesh.uvs is not None and np.isfinite(found.mesh.uvs).all()
    said = "-s and -o 1e+300 1 0 0, expected -1e+06 to 1e+06; read as 1e+06 1 0 0"
    assert any(said in text for text in found.warnings)
