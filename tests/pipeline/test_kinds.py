"""The kind of a file, by its first bytes and its name; advice that a shell and a scene take as it stands."""

from __future__ import annotations

import re
import shlex
import struct
import time
import tomllib
from pathlib import Path

import pytest

from paradize.errors import MAX_MEND, MAX_PART, BakeError, SourceError, bounded
from paradize.kinds import (
    BAKED,
    GLTF,
    HEAD_BYTES,
    HEIGHTS,
    MATERIALS,
    MODEL,
    OBJ,
    PICTURE,
    SCENE,
    SOUND,
    TEXT,
    UNKNOWN,
    Kind,
    kind_of,
    mend_of,
    refusal,
    require_folder,
    require_glb,
)
from paradize.readers.model import read_model

CORNERS = b"\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize(
    ("name", "data", "kind"),
    [
        ("long-head.obj", b"# made by hand\n" * 2000 + b"v 1 2 3\n", OBJ),
        ("A.TGA", b"\0\0\2", PICTURE),
        ("N00E000.HGT", b"\0\1", HEIGHTS),
        ("a.json", b'  {"format": "paradize-scene", "asset": 1}', BAKED),
        ("a.gltf", b'{"asset": {}}', GLTF),
        ("a.json", b'{"other": 1}', TEXT),
        ("a.mtl", b"  newmtl wood\r\n", MATERIALS),
        ("a.toml", b"# a scene\r\n[[object.instance]] # one\r\n", SCENE),
        ("a.bin", b"newmtl wood\0\1", UNKNOWN),
        ("a.txt", b"a table of [wood] and more", TEXT),
    ],
)
def test_a_file_is_what_its_first_bytes_say(name: str, data: bytes, kind: Kind, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    assert kind_of(tmp_path / name) is kind


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.fbx", b"Kaydara FBX Binary  \0\x1a\0", "is an FBX model"),
        ("a.b3dm", b"b3dm\1\0\0\0", "is a batch of 3D Tiles"),
        ("text.fbx", b"; FBX 7.4.0 project file\n", "is an FBX model"),
        ("a.blend", b"BLENDER-v293REND", "is a Blender file"),
        ("packed.blend", b"\x28\xb5\x2f\xfd\0\0", "is a Blender file"),
        ("a.dae", b'<?xml version="1.0"?>\n<!-- by hand -->\n<COLLADA xmlns="x">', "is a COLLADA model"),
        ("a.3ds", b"MM\x10\0\0\0\2\0", "is a 3DS model"),
        ("a.usdc", b"PXR-USDC\0", "is a USD scene"),
        ("a.usda", b"#usda 1.0\n", "is a USD scene"),
        ("a.usdz", b"PK\x03\x04\0\0", "is a USD scene"),
        ("a.x3d", b"<?xml version='1.0'?>\n<X3D profile='x'>", "is an X3D or VRML scene"),
        ("a.off", b"OFF\n8 6 0\n", "is an OFF model"),
        ("a.off", b"# made by hand\nCOFF\n8 6 0\n", "is an OFF model"),
        ("a.ifc", b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\n", "is an IFC model"),
        (
            "a.urdf",
            b'<?xml version="1.0"?>\n<robot name="a">\n<mesh filename="b"/>',
            "is a description of a robot (URDF)",
        ),
        ("a.sdf", b"<sdf version='1.5'>\n<model name='a'>", "is a description of a simulation (SDF)"),
        ("a.vtp", b'<?xml version="1.0"?>\n<VTKFile type="PolyData">', "is a VTK data set"),
        ("a.igs", b" " * 72 + b"S      1\n1H,,1H;,", "is an IGES model"),
        ("a.dxf", b"999\nmade by hand\n  0\nSECTION\n", "is a DXF drawing"),
        ("a.pdb", b"HEADER    HYDROLASE\nATOM      1  N   MET A   1\n", "is a molecule"),
        ("a.ac", b"AC3Db\nMATERIAL x\n", "is an AC3D model"),
        ("a.flt", b"\0\1\1\x44db\0", "is an OpenFlight model"),
        ("a.pcd", b"# .PCD v0.7\nFIELDS x y z\n", "is a PCD point cloud"),
        ("a.json", b'{"type": "CityJSON", "vertices": []}', "is a CityJSON model"),
        ("tileset.json", b'{"asset": {"version": "1.0"}, "geometricError": 1}', "is a tileset of 3D Tiles"),
        ("a.svg", b'<?xml version="1.0"?>\n<!DOCTYPE svg [\n<!ENTITY a "b">\n]>\n<svg>', "is an SVG drawing"),
        ("plane.obj", b"I\n800\nOBJ\n\nTEXTURE a.png\n", "is an X-Plane model"),
        ("a.step", b"ISO-10303-21;\n", "is a STEP model"),
        ("a.nii", b"\x5c\1\0\0", "is a medical volume"),
        ("a.splat", b"\0\1\2\3", "is a cloud of Gaussian splats"),
        ("a.zip", b"PK\x03\x04\0\0", "is a ZIP archive"),
        (
            "a.obj",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n",
            "is a pointer of Git LFS",
        ),
        ("a.glb", b"<!DOCTYPE html>\n<html>", "is a web page"),
        ("a.webp", b"RIFF\0\0\0\0WEBPVP8 ", "is a WebP picture"),
        ("a.wav", b"RIFF\0\0\0\0WAVEfmt ", "is a WAV sound"),
        ("a.wav", b"RIFX\0\0\0\0WAVEfmt ", "is a WAV sound"),
        ("a.wav", b"RF64\xff\xff\xff\xffWAVEds64", "is a WAV sound"),
        ("a.mp3", b"\xff\xfb\x90\xc4\0\0", "is an MP3 sound"),
        ("a.m4a", b"\0\0\0\x20ftypM4A ", "is an AAC sound"),
        ("a.aiff", b"FORM\0\0\0\0AIFFCOMM", "is an AIFF sound"),
        ("a.mp3", b"<!DOCTYPE html>\n<html>", "is a web page"),
        ("a.raw", b"\0\1\0\1\0\1\0\1", "is a heightmap"),
        ("a.asc", b"ncols 2\nnrows 2\n1 2 3 4\n", "is a heightmap"),
    ],
)
def test_what_is_no_model_is_refused_by_its_name_with_a_mend(
    name: str, data: bytes, said: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(SourceError) as caught:
        read_model(tmp_path / name)
    assert caught.value.what == f"{said}, not an OBJ, glTF, PLY or STL model"
    assert caught.value.mend and "name an OBJ" not in caught.value.mend


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.bil", b"\1\0\2\0", "a raw grid of GIS"),
        ("a.DEM", b"MT RAINIER".ljust(864), "a USGS DEM"),
        ("a.nc", b"CDF\1\0\0\0\0", "a netCDF data set"),
        ("a.grd", b"DSAA\n10 10\n", "a Surfer grid"),
        ("a.ter", b"TERRAGENTERRAIN SIZE", "a Terragen terrain"),
    ],
)
def test_heights_of_gis_that_are_not_read_are_named_with_the_command_that_makes_a_geotiff(
    name: str, data: bytes, said: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_bytes(data)
    found = refusal(HEIGHTS, tmp_path / name)
    assert found is not None and found[0] == f"is {said}, not a heightmap"
    assert found[1].startswith(f"`gdal_translate {tmp_path / name} a.tif`")


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.heic", b"\0\0\0\x18ftypheic", "a HEIC photo"),
        ("a.svg", b'<svg xmlns="http://www.w3.org/2000/svg"/>', "an SVG drawing"),
        ("a.xcf", b"gimp xcf v011\0", "a GIMP image"),
        ("a.PCX", b"\n\5\1\x08\0", "a PCX file"),
        ("a.lbm", b"FORM\0\0\0\x10ILBM", "an IFF file"),
    ],
)
def test_pictures_that_are_not_read_are_named(name: str, data: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    found = refusal(PICTURE, tmp_path / name)
    assert found == (f"is {said}, not a picture", "save it as PNG, TIFF or OpenEXR")


def test_a_text_of_sections_is_a_scene_only_where_it_is_toml(tmp_path: Path) -> None:
    for name, data, kind in (
        ("a.grd", b"[general]\ncreator=R package\n[data]\nnbands=1\n", TEXT),
        ("a.toml", b"[general]\ncreator=R package\n", SCENE),  # a fault of a scene is told by its reader
        ("a.scene", b"[sky]\nturbidity = 3\n", SCENE),
    ):
        (tmp_path / name).write_bytes(data)
        assert kind_of(tmp_path / name) is kind, name


def test_the_kind_of_a_text_is_found_in_time_that_grows_with_its_length(tmp_path: Path) -> None:
    for begin, repeated, count in (
        (b"", b"\n", 23),
        (b"", b"# made by hand\n\n", 18),
        (b"<?xml?>", b"<!-- a -->", 1500),
        (b"[a.", b" ", 2000),
    ):
        (tmp_path / "a").write_bytes(begin + count * repeated + b"!")
        before = time.process_time()
        assert kind_of(tmp_path / "a") is TEXT
        assert time.process_time() - before < 0.5, (begin, repeated)


def test_xml_is_of_the_kind_of_its_root_element(tmp_path: Path) -> None:
    (tmp_path / "a.xml").write_bytes(b'<mujoco>\n<asset><mesh file="a.stl"/></asset>\n</mujoco>\n')
    assert kind_of(tmp_path / "a.xml") is TEXT
    (tmp_path / "b.xml").write_bytes(b'<?xml version="1.0"?>\n<mujoco><mesh file="a.stl"/></mujoco>\n')
    assert kind_of(tmp_path / "b.xml") is TEXT


def test_a_gltf_may_hold_the_word_by_which_a_tileset_is_known(tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_bytes(b'{"asset": {"version": "2.0"}, "nodes": [{"extras": {"geometricError": 1}}]}')
    assert kind_of(path) is GLTF


def test_a_targa_whose_palette_begins_late_is_a_picture(tmp_path: Path) -> None:
    (tmp_path / "a.tga").write_bytes(b"\0\1\1\x30\0\1\0\x18" + bytes(40))
    assert kind_of(tmp_path / "a.tga") is PICTURE


def test_a_scene_that_is_longer_than_what_is_looked_at_is_a_scene(tmp_path: Path) -> None:
    path = tmp_path / "a.scene"
    begin = b"[sky]\nturbidity = 3\n# "
    path.write_bytes(begin.ljust(HEAD_BYTES - 4, b"-") + b'\n[scene]\nname = "a"\n')  # cut in a header
    assert kind_of(path) is SCENE


@pytest.mark.parametrize("header", [b"GRIB bowl", b"AC3D export", b"3D Geometry File Format"])
def test_the_header_of_a_binary_stl_may_begin_as_another_kind(header: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    corners = struct.pack("<12f", 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0)
    path.write_bytes(header.ljust(80, b"\0") + struct.pack("<I", 1) + corners + b"\0\0")
    assert len(read_model(path).mesh.triangles) == 1


@pytest.mark.parametrize("suffix", [".obj", ".glb", ".gltf", ".ply", ".stl", ".txt"])
@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"PK\x03\x04\x14\0\0\0" + b"\0" * 18 + b"a.obj" + CORNERS, "is a ZIP archive"),  # stored, not packed
        (b"\x1f\x8b\x08\0" + CORNERS, "is a file that gzip packed"),
        (b"\x89PNG\r\n\x1a\n" + CORNERS, "is a PNG picture"),
        (b"<!DOCTYPE html>\n<html>", "is a web page"),
    ],
)
def test_a_file_of_another_kind_is_no_model_whatever_it_is_named_and_holds(
    suffix: str, data: bytes, said: str, tmp_path: Path
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(data)
    with pytest.raises(SourceError) as caught:
        read_model(path)
    assert caught.value.what == f"{said}, not an OBJ, glTF, PLY or STL model"


@pytest.mark.parametrize("suffix", [".glb", ".ply", ".stl"])
def test_an_obj_is_read_whatever_it_is_named(suffix: str, tmp_path: Path) -> None:
    (tmp_path / f"a{suffix}").write_bytes(CORNERS)
    assert read_model(tmp_path / f"a{suffix}").counts["triangles"] == 1


def test_text_is_left_to_the_readers_of_text_and_what_is_unknown_to_those_of_pictures(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("anything")
    assert refusal(MODEL, tmp_path / "a.txt") is None
    assert refusal(SCENE, tmp_path / "a.txt") is None
    assert refusal(PICTURE, tmp_path / "a.txt") is not None
    (tmp_path / "a.bin").write_bytes(bytes(range(256)))
    assert refusal(PICTURE, tmp_path / "a.bin") is None and refusal(HEIGHTS, tmp_path / "a.bin") is None
    assert refusal(MODEL, tmp_path / "a.bin") is not None


def test_a_folder_is_no_file_and_one_without_its_scene_no_bake(tmp_path: Path) -> None:
    for wanted, words in (
        (MODEL, "is a folder, not an OBJ, glTF, PLY or STL model"),
        (BAKED, "holds no scene.json"),
    ):
        found = refusal(wanted, tmp_path)
        assert found is not None and found[0] == words


def test_a_folder_of_paradize_new_is_told_with_the_scene_in_it(tmp_path: Path) -> None:
    found = refusal(SCENE, tmp_path)
    assert found is not None and "`paradize new DIR`" in found[1]
    (tmp_path / "scene.toml").touch()
    assert refusal(SCENE, tmp_path) == (
        "is a folder, not a scene TOML",
        f"did you mean {tmp_path / 'scene.toml'}?",
    )


@pytest.mark.parametrize("name", ["post.obj", "-post.obj", "two words.obj", "o'clock $HOME.obj"])
def test_a_shell_takes_the_advised_command_whatever_the_files_name(name: str) -> None:
    advised = re.findall(r"`(paradize [^`]*)`", mend_of(OBJ, Path(name)))
    assert len(advised) == 2
    file, stem = (f"./{name}", f"./{name[:-4]}") if name.startswith("-") else (name, name[:-4])
    assert shlex.split(advised[0]) == ["paradize", "mesh", file, "-o", f"{stem}.glb"]
    assert shlex.split(advised[1]) == ["paradize", "new", f"{stem}-scene", "--from", file]


@pytest.mark.parametrize("name", ["sea.ogg", 'a "quoted" sea.ogg', "back\\slash.ogg"])
def test_a_scene_takes_the_advised_line_whatever_the_files_name(name: str) -> None:
    line = re.search(r"`(file = .*)` under", mend_of(SOUND, Path(name)))
    assert line is not None and tomllib.loads(line[1]) == {"file": name}


def test_an_outputs_name_counts_whatever_its_case_and_folders_that_stand_may_have_any(tmp_path: Path) -> None:
    require_glb(Path("A.GLB"))
    with pytest.raises(BakeError, match=r"\.gltf"):
        require_glb(Path("a.gltf"))
    for name, advised in (
        ("a", "a.glb"),
        ("a.", "a.glb"),
        ("a.obj", "a.glb"),
        ("out/v1.2", "out/v1.2.glb"),
        ("...a", "...a.glb"),
        ("./-a.obj", "./-a.glb"),
    ):
        with pytest.raises(BakeError, match=re.escape(f"write `-o {advised}`")):
            require_glb(Path(name))
    for name in ("", ".."):
        with pytest.raises(BakeError, match="names a folder"):
            require_glb(Path(name))
    with pytest.raises(BakeError, match="name of a file"):
        require_folder(tmp_path / "A.GLB")
    (tmp_path / "A.GLB").mkdir()
    require_folder(tmp_path / "A.GLB")


PICTURES = ("png", "tif", "TIFF", "gif", "exr", "jpg", "JPEG", "hdr", "dds", "tga", "webp", "hgt", "asc")
OTHERS = ("obj", "gltf", "glb", "ply", "stl", "fbx", "blend", "mtl", "toml", "json", "ogg", "zip")


@pytest.mark.parametrize("name", [f"x.{suffix}" for suffix in (*PICTURES, *OTHERS)])
def test_a_folder_is_not_made_under_the_name_of_any_kind_of_file(tmp_path: Path, name: str) -> None:
    with pytest.raises(BakeError, match=f"looks like the name of a file.*`--report {tmp_path}/x`"):
        require_folder(tmp_path / name, "--report")


def test_a_folders_name_may_hold_a_dot(tmp_path: Path) -> None:
    for name in ("v1.2", "rock.maps", "my.scene", ".hidden", "x."):
        require_folder(tmp_path / name)


def test_a_message_loses_its_middle_alone_and_no_more_than_it_must() -> None:
    assert bounded("x" * MAX_PART) == "x" * MAX_PART
    for most in (MAX_PART, MAX_MEND):
        cut = bounded("first" + "x" * 9000 + "last", most)
        assert len(cut) == most and cut.startswith("first") and cut.endswith("last")
    assert str(BakeError("is wrong", mend="y" * MAX_MEND)).endswith("y" * MAX_MEND)
