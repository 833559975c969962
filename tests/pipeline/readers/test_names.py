"""Names of pictures and libraries that lead nowhere lead to the file that was meant; a warning says so."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from paradize.errors import SourceError
from paradize.readers.model import read_model
from paradize.readers.names import inside, spelled_otherwise, without_comment
from paradize.readers.obj import read_obj
from paradize.store.local import stamp
from tests.pipeline.readers.gltf.made import PNG, shown, square
from tests.pipeline.readers.test_obj import TRIANGLE, read
from tests.pipeline.readers.test_ply import columns, ply
from tests.processor_time import ratio

UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("BARK.PNG", "bark.png"),
        ("Tex\\Bark.png", "tex/bark.PNG"),
        ('"my bark.png"', "my bark.png"),
        ("my%20bark.png", "my bark.png"),
        ("My%20Bark.png", "my bark.png"),
        ("file:///C:/tex/bark.png", "bark.png"),
        ("C:\\tex\\BARK.png", "bark.png"),
        ("bark.png # of oak", "bark.png"),
        ("e\u0301corce.png", "\u00e9corce.png"),
    ],
)
def test_a_map_is_found_where_its_name_is_spelled_otherwise(tmp_path: Path, name: str, file: str) -> None:
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_bytes(PNG)
    (tmp_path / "a.mtl").write_text(f"newmtl wood\nmap_Kd {name}\n")
    result = read(tmp_path, "mtllib a.mtl\n" + TRIANGLE + "usemtl wood\nf 1 2 3\n")
    assert result.materials["wood"].picture("color") == (tmp_path / file).resolve()
    assert len(result.warnings) == 1 and f"{Path(file).name!r}" in result.warnings[0]
    assert "is read instead" in result.warnings[0]


def test_a_picture_and_a_buffer_of_a_gltf_are_found_in_other_letters(tmp_path: Path) -> None:
    made, primitive = square(TEXCOORD_0=UVS)
    made.add("images", uri="Red%20Wood.PNG")
    texture = {"index": made.add("textures", source=0)}
    primitive["material"] = made.add("materials", pbrMetallicRoughness={"baseColorTexture": texture})
    (tmp_path / "red wood.png").write_bytes(PNG)
    (tmp_path / "data.bin").write_bytes(made.data)
    model = read_model(shown(primitive, made).gltf(tmp_path / "a.gltf", "DATA.bin"))
    assert model.materials["material_0"].picture("color") == (tmp_path / "red wood.png").resolve()
    told = [text.split(": ", 1)[1] for text in model.warnings]
    assert told == [
        "/images/0: 'Red%20Wood.PNG' does not exist; 'red wood.png' is read instead",
        "/buffers/0: 'DATA.bin' does not exist; 'data.bin' is read instead",
    ]


def test_a_material_file_is_found_in_other_letters(tmp_path: Path) -> None:
    (tmp_path / "my wood.mtl").write_text("newmtl wood\nKd 1 0 0\n")
    result = read(tmp_path, "mtllib My Wood.mtl\n" + TRIANGLE + "usemtl wood\nf 1 2 3\n")
    assert result.materials["wood"].color == (1.0, 0.0, 0.0)
    said = "material file 'My Wood.mtl' does not exist; 'my wood.mtl' is read instead"
    assert result.warnings[0].endswith(said)


@pytest.mark.parametrize(
    ("library", "used", "defined"),
    [
        ("a.mtl # mine", "wood # oak", "wood"),
        ("a.mtl", "wood", "wood # oak"),
        ("a.mtl b.mtl # both", "wood # trunk", "wood\t# oak"),
    ],
)
def test_what_stands_behind_a_name_as_a_comment_is_none_of_it(
    tmp_path: Path, library: str, used: str, defined: str
) -> None:
    (tmp_path / "a.mtl").write_text(f"newmtl {defined}\nKd 1 0 0\n")
    (tmp_path / "b.mtl").write_text("newmtl stone\n")
    result = read(tmp_path, f"mtllib {library}\n{TRIANGLE}usemtl {used}\nf 1 2 3\n")
    assert result.materials[result.mesh.groups[0].material].color == (1.0, 0.0, 0.0)
    assert [text for text in result.warnings if "is not defined; read as" in text]
    assert not [text for text in result.warnings if "missing" in text or "drawn white" in text]


def test_a_map_is_drawn_anew_for_a_material_whose_name_has_a_comment_behind_it(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        (tmp_path / name).write_bytes(PNG)
    (tmp_path / "a.mtl").write_text("newmtl wood\nmap_Kd a.png\nmap_d -s 0.5 0.5 b.png\n")
    faces = "vt 0 0\nvt 1 0\nvt 0 1\nusemtl {}\nf 1/1 2/2 3/3\n"
    plain, commented = (
        read(tmp_path, "mtllib a.mtl\n" + TRIANGLE + faces.format(name)) for name in ("wood", "wood # oak")
    )
    placed = plain.materials["wood"].maps["alpha"].placed
    assert placed is not None and commented.materials["wood"].maps["alpha"].placed == placed


def test_a_library_of_the_models_name_is_not_read_where_comments_alone_differ(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text("newmtl wood # oak\nKd 1 0 0\n")
    (tmp_path / "a.mtl").write_text("newmtl wood\nKd 0 1 0\n")
    result = read(tmp_path, "mtllib m.mtl\n" + TRIANGLE + "usemtl wood\nf 1 2 3\n")
    assert result.materials[result.mesh.groups[0].material].color == (1.0, 0.0, 0.0)
    assert [path.name for path in result.libraries] == ["m.mtl"]


def test_of_several_materials_that_a_name_may_mean_none_is_taken(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl wood # oak\nKd 1 0 0\nnewmtl wood # elm\nKd 0 1 0\n")
    result = read(tmp_path, f"mtllib a.mtl\n{TRIANGLE}usemtl wood\nf 1 2 3\n")
    assert [group.material for group in result.mesh.groups] == ["wood"]
    assert len(result.warnings) == 1 and "not defined: 'wood'" in result.warnings[0]


def test_a_name_with_many_blanks_takes_time_in_proportion_to_them() -> None:
    names = ["a" + " " * count + "#b" for count in (20_000, 1_000)]
    assert [without_comment(name) for name in names] == names
    assert ratio(lambda: without_comment(names[0]), lambda: without_comment(names[1])) < 100


def test_a_name_that_no_file_can_have_is_not_followed(tmp_path: Path) -> None:
    """Folder by folder, a megabyte of `../` took minutes."""
    assert inside(tmp_path, tmp_path, "x/../" * 800 + "a") == tmp_path / "a"
    assert inside(tmp_path, tmp_path, "x/../" * 820 + "a") is None


def test_a_sign_that_belongs_to_a_name_stays(tmp_path: Path) -> None:
    (tmp_path / "a #1.mtl").write_text("newmtl Material #25\nKd 1 0 0\nnewmtl wood # oak\nKd 0 1 0\n")
    names = ("Material #25", "wood # oak", "Material #26")
    faces = "".join(f"usemtl {name}\nf 1 2 3\n" for name in names)
    result = read(tmp_path, f"mtllib a #1.mtl\n{TRIANGLE}{faces}")
    assert [group.material for group in result.mesh.groups] == list(names)
    assert len(result.warnings) == 1 and "not defined: 'Material #26'" in result.warnings[0]


def test_a_path_of_another_machine_leads_to_the_file_beside(tmp_path: Path) -> None:
    (tmp_path / "wood.mtl").write_text("newmtl wood\nKd 1 0 0\n")
    statement = "mtllib C:\\My Models\\Wood.mtl\n"
    result = read(tmp_path, statement + TRIANGLE + "usemtl wood\nf 1 2 3\n")
    assert result.materials["wood"].color == (1.0, 0.0, 0.0)
    assert "is a path of another machine; 'wood.mtl' beside the file is read instead" in result.warnings[0]
    made, primitive = square(TEXCOORD_0=UVS)
    made.add("images", uri="file:///C:/tex/red.png")
    texture = {"index": made.add("textures", source=0)}
    primitive["material"] = made.add("materials", pbrMetallicRoughness={"baseColorTexture": texture})
    (tmp_path / "red.png").write_bytes(PNG)
    (tmp_path / "data.bin").write_bytes(made.data)
    model = read_model(shown(primitive, made).gltf(tmp_path / "a.gltf", "/home/me/data.bin"))
    assert model.materials["material_0"].picture("color") == (tmp_path / "red.png").resolve()
    assert len(model.warnings) == 2


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("C:\\\\work\\\\my project\\\\textures\\\\wood.png", "textures/wood.png"),
        ("/home/me/game/Images/Oak/wood.png", "images/oak/wood.png"),
        ("F:\\all my work\\wood.png", "wood.png"),
        ("F:\\all my work\\wood.png", "models/Textures/wood.png"),
        ("textures/wood.png", "textures/wood.png"),
        ("my desktop/oak/wood.png", "models/wood.png"),
        ("Wood.png", "Textures/wood.png"),
        ("wood.png", "models/tex/wood.png"),
        ("../bitmaps/wood.png", "maps/wood.png"),
        ("wood.png", "materials/textures/wood.png"),
        ("oak/Wood.png", "Materials/Textures/Maps/wood.png"),
        ("C:\\wood.png", "models/Images/tex/wood.png"),
        ("C:\\wood.png", "textures/house/wood.png"),
        ("wood.png", "Textures/city/old house/wood.png"),
    ],
)
def test_a_picture_is_found_where_a_project_keeps_its_pictures(tmp_path: Path, name: str, file: str) -> None:
    """Models and pictures often have a folder each, and models name paths of the machine of their maker."""
    models = tmp_path / "models"
    for folder in (models, (tmp_path / file).parent):
        folder.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).write_bytes(PNG)
    (models / "a.mtl").write_text(f"newmtl wood\nmap_Kd {name}\n")
    result = read(models, "mtllib a.mtl\n" + TRIANGLE + "usemtl wood\nf 1 2 3\n")
    assert result.materials["wood"].picture("color") == (tmp_path / file).resolve()
    there = Path(os.path.relpath(tmp_path / file, models)).as_posix()
    (said,) = result.warnings
    assert repr(there) in said and said.endswith("is read instead")


def test_of_several_pictures_the_nearest_to_the_name_is_read(tmp_path: Path) -> None:
    files = ("models/sub/a.png", "sub/a.png", "models/a.png", "a.png", "models/maps/a.png", "textures/a.png")
    for file in files:
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_bytes(PNG)
    for file in files:
        found = spelled_otherwise(tmp_path.parent, tmp_path / "models", "D:\\x\\sub\\a.png")
        assert found is not None and found[0] == (tmp_path / file).resolve()
        (tmp_path / file).unlink()
    assert spelled_otherwise(tmp_path, tmp_path / "models", "D:\\x\\sub\\a.png") is None


@pytest.mark.parametrize(
    ("statement", "missing"),
    [
        ("./Human Heart.mtl", ["./Human Heart.mtl"]),
        ("gone.mtl  My Wood.MTL", ["gone.mtl", "My Wood.MTL"]),
        ("old gone.mtl b.mtl", ["old gone.mtl"]),
        ("gone b.mtl", ["gone"]),
        ("gone B.MTL", ["gone"]),
        ("one two", ["one two"]),
    ],
)
def test_a_missing_material_file_is_told_by_its_whole_name(
    tmp_path: Path, statement: str, missing: list[str]
) -> None:
    (tmp_path / "b.mtl").write_text("newmtl wood\n")
    (tmp_path / "a.obj").write_text(f"mtllib {statement}\n{TRIANGLE}f 1 2 3\n")
    told = [text for text in read_model(tmp_path / "a.obj").warnings if "mtllib line" in text]
    assert [text.split("material file ")[1].split("'")[1] for text in told] == missing


@pytest.mark.parametrize("name", [".", "textures/", "wood.png"])
def test_a_folder_in_a_files_place_is_no_file_and_told(tmp_path: Path, name: str) -> None:
    for folder in ("textures", "wood.png", "a.mtl"):
        (tmp_path / folder).mkdir()
    (tmp_path / "b.mtl").write_text(f"newmtl wood\nmap_Kd {name}\n")
    (tmp_path / "a.obj").write_text(f"mtllib {name}\nmtllib b.mtl\n" + TRIANGLE + "usemtl wood\nf 1 2 3\n")
    vertex = columns("float", "x y z s t", np.eye(3, 5))
    (tmp_path / "a.ply").write_bytes(ply("ascii", vertex, [[0, 1, 2]], f"comment TextureFile {name}\n"))
    made, primitive = square(TEXCOORD_0=UVS)
    made.add("images", uri=name)
    texture = {"index": made.add("textures", source=0)}
    primitive["material"] = made.add("materials", pbrMetallicRoughness={"baseColorTexture": texture})
    shown(primitive, made).gltf(tmp_path / "a.gltf", "data.bin")
    (tmp_path / "data.bin").write_bytes(made.data)
    for file, count in (("a.obj", 2), ("a.ply", 1), ("a.gltf", 1)):
        model = read_model(tmp_path / file)
        assert all(material.picture("color") is None for material in model.materials.values())
        told = [text for text in model.warnings if f"{name!r} is a folder; " in text]
        assert len(told) == len(model.warnings) == count, model.warnings
        assert (tmp_path / name).resolve() in model.absent


def test_a_folder_is_stamped_as_a_missing_file(tmp_path: Path) -> None:
    """A bake looks again for what was missing: a folder that a model names stands for nothing there."""
    assert stamp(tmp_path) is None and stamp(tmp_path / "none") is None
    (tmp_path / "wood.png").write_bytes(PNG)
    assert stamp(tmp_path / "wood.png")


def test_of_several_pictures_in_folders_of_folders_none_is_taken_and_none_outside_the_root(
    tmp_path: Path,
) -> None:
    root, out = tmp_path / "root", tmp_path / "out"
    for folder in (root / "materials/textures", root / "materials/images", out / "textures", root / "meshes"):
        folder.mkdir(parents=True)
    for folder in (root / "materials/textures", out / "textures", root / "materials/oak"):
        folder.mkdir(exist_ok=True)
        (folder / "a.png").write_bytes(PNG)
    (root / "textures").symlink_to(out)
    (root / "images").symlink_to(root / "materials")  # to the one picture again
    found = spelled_otherwise(root, root / "meshes", "a.png")
    assert found is not None and found[0] == root.resolve() / "materials/textures/a.png"
    (root / "materials/images/a.png").write_bytes(PNG)  # and in materials/oak, too
    assert spelled_otherwise(root, root / "meshes", "a.png") is None
    assert spelled_otherwise(root / "meshes", root / "meshes", "a.png") is None
    (root / "house").mkdir()
    (root / "house/b.png").write_bytes(PNG)  # in no folder of pictures
    assert spelled_otherwise(root, root / "meshes", "b.png") is None


def test_the_buffer_of_another_model_is_not_read(tmp_path: Path) -> None:
    made, primitive = square()
    (tmp_path / "scene.bin").write_bytes(made.data)
    (tmp_path / "oak").mkdir()
    with pytest.raises(SourceError, match=r"oak/scene\.bin: cannot be read: No such file"):
        read_model(shown(primitive, made).gltf(tmp_path / "oak/scene.gltf", "scene.bin"))


def test_no_other_spelling_leads_out_of_the_root_or_is_a_guess(tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.mkdir()
    (tmp_path / "out.png").write_bytes(PNG)
    (root / "link.png").symlink_to(tmp_path / "out.png")
    for name in ("a.png", "A.png"):
        (root / name).write_bytes(PNG)
    for name in (
        "../OUT.png",
        "LINK.png",
        "..%2Fout.png",
        "A.PNG",
        "none.png",
        "",
        "%00",
        '"',
        "/etc/passwd",
        "C:",
        "/",
        "file://",
    ):
        assert spelled_otherwise(root, root, name) is None, name


@pytest.mark.parametrize("end", [b"\x1a", b"\0", b"\n\x1a", b"\n" + bytes(5), b"\x1a\0\0"])
def test_end_marks_behind_a_text_are_none_of_it(tmp_path: Path, end: bytes) -> None:
    """Ctrl-Z of old systems, and zeros that fill a block."""
    files = {
        "a.obj": f"mtllib a.mtl\n{TRIANGLE}usemtl wood\nf 1 2 3".encode(),
        "a.mtl": b"newmtl wood\nKd 1 0 0.5",
        "a.ply": ply("ascii", columns("float", "x y z", np.eye(3)), [[0, 1, 2]]).rstrip(),
        "a.stl": b"solid a\nfacet normal 0 0 1\nouter loop\n"
        + b"vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid",
        "a.gltf": shown(square()[1], square()[0]).gltf(tmp_path / "b.gltf").read_bytes(),
    }
    for name, text in files.items():
        (tmp_path / name).write_bytes(text + end)
    for name in ("a.obj", "a.ply", "a.stl", "a.gltf"):
        model = read_model(tmp_path / name)
        assert model.counts["triangles"] == (2 if name == "a.gltf" else 1) and not model.warnings
    assert read_model(tmp_path / "a.obj").materials["wood"].color == (1.0, 0.0, 0.5)


def test_zeros_behind_the_json_of_a_glb_are_blanks(tmp_path: Path) -> None:
    data = shown(square()[1], square()[0]).glb(tmp_path / "a.glb").read_bytes()
    total, length = (int.from_bytes(data[at : at + 4], "little") for at in (8, 12))
    sizes = [(total + 4).to_bytes(4, "little"), (length + 4).to_bytes(4, "little")]
    padded = data[:8] + b"".join(sizes) + data[16 : 20 + length] + bytes(4) + data[20 + length :]
    (tmp_path / "a.glb").write_bytes(padded)
    model = read_model(tmp_path / "a.glb")
    assert model.counts["triangles"] == 2 and not model.warnings


def test_texts_of_models_in_utf_16_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_bytes("newmtl wood\n".encode("utf-16"))
    with pytest.raises(SourceError, match=r"a\.mtl: the text is UTF-16; save it as UTF-8"):
        read(tmp_path, "mtllib a.mtl\n" + TRIANGLE + "f 1 2 3\n")
    (tmp_path / "b.obj").write_bytes(TRIANGLE.encode("utf-32"))
    with pytest.raises(SourceError, match=r"b\.obj: the text is UTF-32; save it as UTF-8"):
        read_obj(tmp_path / "b.obj")
