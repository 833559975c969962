"""Every rule of `paradize check` fires on the fault that it names, and a sound scene is clean."""

from __future__ import annotations

import hashlib
import io
import json
import os
import shutil
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import soundfile

from paradize.bakers.mesh.bake import bake_mesh
from paradize.build.light_sets import add_light_sets
from paradize.checks import CheckOptions, Finding, check_paths, render
from paradize.checks.rules import RULES, gathered
from paradize.checks.sounds import check_sound
from paradize.data import Texture
from paradize.errors import FormatError
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.scene.baker_settings import MeshSettings
from tests.pipeline.bakes import bake_apart
from tests.pipeline.checks.test_lights import light
from tests.pipeline.checks.test_skies import sunny
from tests.pipeline.scenes import make_free_cove
from tests.sweeps import sweep


@pytest.fixture(scope="module")
def sound_scene(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> Path:
    top = tmp_path_factory.mktemp("cove")
    cove_store(top / "store")
    bake_apart(make_free_cove(top / "scene"), top)
    return top / "out"


@pytest.fixture
def scene(sound_scene: Path, tmp_path: Path) -> Path:
    shutil.copytree(sound_scene, tmp_path / "out")
    return tmp_path / "out"


def file_of(scene: Path, name: str) -> Path:
    return scene / json.loads((scene / "scene.json").read_text())["artifacts"][name]["file"]


def replace(scene: Path, name: str, data: bytes) -> None:
    """Gives an artifact other bytes, and the manifest their hash: only the content is at fault."""
    change(
        scene, lambda m: m["artifacts"][name].update(sha256=hashlib.sha256(data).hexdigest(), bytes=len(data))
    )
    file_of(scene, name).write_bytes(data)


def change(scene: Path, edit: Callable[[dict[str, Any]], Any]) -> None:
    tree = json.loads((scene / "scene.json").read_text())
    edit(tree)
    (scene / "scene.json").write_text(json.dumps(tree))


def with_accessor(data: bytes, attribute: str, edit: Callable[[np.ndarray], None], level: int = 0) -> bytes:
    """The GLB with one array of a level's first primitive changed in place; attribute "indices" for those."""
    length = struct.unpack_from("<I", data, 12)[0]
    tree = json.loads(data[20 : 20 + length])
    primitive = tree["meshes"][tree["nodes"][level]["mesh"]]["primitives"][0]
    at = primitive["indices"] if attribute == "indices" else primitive["attributes"][attribute]
    accessor = tree["accessors"][at]
    view = tree["bufferViews"][accessor["bufferView"]]
    start = 28 + length + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    kind = {5123: np.uint16, 5125: np.uint32, 5126: np.float32}[accessor["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    changed = bytearray(data)
    array = np.frombuffer(changed, kind, accessor["count"] * width, start).reshape(-1, width)
    edit(array)
    return bytes(changed)


def with_json(data: bytes, edit: Callable[[dict[str, Any]], Any]) -> bytes:
    length = struct.unpack_from("<I", data, 12)[0]
    tree = json.loads(data[20 : 20 + length])
    edit(tree)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + data[20 + length :]
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def edit_mesh(attribute: str, edit: Callable[[np.ndarray], None], level: int = 0) -> Callable[[Path], None]:
    """level: the node whose first primitive is changed."""
    return lambda scene: replace(
        scene, "post_mesh", with_accessor(file_of(scene, "post_mesh").read_bytes(), attribute, edit, level)
    )


def put(row: int, column: int | slice, value: float) -> Callable[[np.ndarray], None]:
    def edit(array: np.ndarray) -> None:
        array[row, column] = value

    return edit


def scale(row: int, factor: float, columns: int = 4) -> Callable[[np.ndarray], None]:
    def edit(array: np.ndarray) -> None:
        array[row, :columns] *= factor

    return edit


def lean(way: float) -> Callable[[Path], None]:
    def fault(scene: Path) -> None:
        data = file_of(scene, "post_mesh").read_bytes()
        found: list[np.ndarray] = []
        with_accessor(data, "NORMAL", lambda array: found.append(array.copy()))

        def edit(tangents: np.ndarray) -> None:
            tangents[5, :3] = way * found[0][5]

        replace(scene, "post_mesh", with_accessor(data, "TANGENT", edit))

    return fault


def same_corner(a: int, b: int) -> Callable[[np.ndarray], None]:
    def edit(indices: np.ndarray) -> None:
        indices[b, 0] = indices[a, 0]

    return edit


def turned(indices: np.ndarray) -> None:
    triangles = indices.reshape(-1, 3)
    triangles[:] = triangles[:, ::-1].copy()


def swapped_lods(scene: Path) -> None:
    def edit(tree: dict[str, Any]) -> None:
        a, b = tree["nodes"][1], tree["nodes"][2]
        a["mesh"], b["mesh"] = b["mesh"], a["mesh"]

    replace(scene, "post_mesh", with_json(file_of(scene, "post_mesh").read_bytes(), edit))


def errors_of_levels(*errors: float) -> Callable[[Path], None]:
    """error_max of the levels, the finest first; those after the last keep theirs."""

    def edit(tree: dict[str, Any]) -> None:
        for node, error in zip(tree["nodes"], errors, strict=False):
            node["extras"]["error_max"] = error

    return lambda scene: replace(
        scene, "post_mesh", with_json(file_of(scene, "post_mesh").read_bytes(), edit)
    )


def bare_glb(tree: dict[str, Any]) -> bytes:
    """A GLB of a JSON chunk alone."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON") + text


def no_mesh(scene: Path) -> None:
    (scene / "scene.json").unlink()  # a folder of files alone: in a scene such a file is an error besides
    (scene / "empty.glb").write_bytes(bare_glb({"asset": {"version": "2.0"}}))


def modest(scene: Path) -> None:
    def edit(tree: dict[str, Any]) -> None:
        for node in tree["nodes"]:
            node["extras"]["error_max"] *= 0.97

    replace(scene, "post_mesh", with_json(file_of(scene, "post_mesh").read_bytes(), edit))


def measured(edit: Callable[[dict[str, Any]], object]) -> Callable[[Path], None]:
    """edit: changes the extras of the post's material."""
    return lambda scene: replace(
        scene,
        "post_mesh",
        with_json(
            file_of(scene, "post_mesh").read_bytes(), lambda tree: edit(tree["materials"][0]["extras"])
        ),
    )


def folded(uvs: np.ndarray) -> None:
    uvs[:, 0] = np.abs(2.0 * uvs[:, 0] - 1.0)


def squeezed(uvs: np.ndarray) -> None:
    uvs[:, 1] = np.where(uvs[:, 1] < 0.5, 0.005 * uvs[:, 1], uvs[:, 1])


def unguarded(plant: Callable[[Path], None]) -> Callable[[Path], None]:
    """The same with no gutters told: what neighbours share is for other rules."""

    def fault(scene: Path) -> None:
        plant(scene)
        change(scene, lambda m: [entry.update(gutter=None) for entry in m["artifacts"].values()])

    return fault


def shaded(plant: Callable[[Path], None]) -> Callable[[Path], None]:
    """The same with an occlusion map, which the strength of highlights stands for."""

    def fault(scene: Path) -> None:
        plant(scene)
        change(
            scene,
            lambda m: [
                one["maps"].update(occlusion=one["maps"]["gloss"])
                for one in m["objects"][0]["materials"].values()
            ],
        )

    return fault


def lower(tree: dict[str, Any], by_m: float) -> None:
    for segment in tree["flight"]["segments"]:
        segment["eye"][1][0] -= by_m


def tone(hertz: float, size: float, channels: int = 1) -> bytes:
    """A second of a sine as Ogg Vorbis."""
    wave = size * np.sin(2 * np.pi * hertz * np.arange(8000) / 8000)
    held = io.BytesIO()
    samples = np.stack([wave] * channels, 1).astype(np.float32)
    soundfile.write(held, samples, 8000, format="OGG", subtype="VORBIS")
    return held.getvalue()


def placed_stereo(scene: Path) -> None:
    change(scene, lambda m: m["sounds"][0].update(places=[[0, 1, 0]]))
    replace(scene, "sound", tone(440.0, 0.2, channels=2))


def clicking(size: float) -> Callable[[Path], None]:
    return lambda scene: replace(scene, "sound", tone(110.25, size))


def packed(edit: Callable[[bytearray, int], None] = lambda data, at: None) -> Callable[[Path], None]:
    """A supercompressed texture, changed: edit(file's bytes, where level 0's frame starts)."""

    def fault(scene: Path) -> None:
        file = file_of(scene, "post_color")
        data = bytearray(encode_ktx2(decode_ktx2(file.read_bytes()), zstd_level=3))
        edit(data, struct.unpack_from("<Q", data, 80)[0])
        replace(scene, "post_color", bytes(data))

    return fault


def no_frame(data: bytearray, at: int) -> None:
    data[at] ^= 0xFF


def other_length(data: bytearray, at: int) -> None:
    struct.pack_into("<Q", data, 96, 1 << 40)


def short_chain(scene: Path) -> None:
    data = bytearray(file_of(scene, "sand_color").read_bytes())
    struct.pack_into("<I", data, 40, struct.unpack_from("<I", data, 40)[0] - 1)
    replace(scene, "sand_color", bytes(data))


def cut_texture(scene: Path) -> None:
    data = file_of(scene, "sand_color").read_bytes()
    replace(scene, "sand_color", data[: len(data) - 100])


def nan_sky(scene: Path) -> None:
    texture = decode_ktx2(file_of(scene, "sky").read_bytes())
    level = bytearray(texture.levels[0])
    level[0:2] = struct.pack("<e", float("nan"))
    from dataclasses import replace as other

    replace(scene, "sky", encode_ktx2(other(texture, levels=(bytes(level), *texture.levels[1:]))))


def turned_dudv(scene: Path) -> None:
    texture = decode_ktx2(file_of(scene, "water_dudv").read_bytes())
    turned = [(-np.frombuffer(level, np.int8)).tobytes() for level in texture.levels]
    replace(
        scene,
        "water_dudv",
        encode_ktx2(Texture(texture.format, texture.width, texture.height, tuple(turned))),
    )


def color_as_normal(scene: Path) -> None:
    replace(scene, "sand_normal", file_of(scene, "sand_color").read_bytes())


def last_level(name: str, beyond: int) -> Callable[[Path], None]:
    """The scene lets the player read so many levels more than there are."""

    def fault(scene: Path) -> None:
        last = len(decode_ktx2(file_of(scene, name).read_bytes()).levels) - 1
        change(scene, lambda tree: tree["artifacts"][name].update(max_level=last + beyond))

    return fault


def jump(tree: dict[str, Any], key: str, metres: float, speed: float) -> None:
    """A segment that begins elsewhere, or goes another way to where the next one begins."""
    cubic = tree["flight"]["segments"][2][key][1]
    cubic[0] += metres
    cubic[2] += speed
    cubic[3] -= speed


def manifest(edit: Callable[[dict[str, Any]], Any]) -> Callable[[Path], None]:
    return lambda scene: change(scene, edit)


def cut_mesh(scene: Path) -> None:
    replace(scene, "post_mesh", file_of(scene, "post_mesh").read_bytes()[:-64])


def soft_budget(tree: dict[str, Any], metric: str) -> None:
    tree["budget"]["soft"][metric] = 0.0


def idle_waiver(tree: dict[str, Any]) -> None:
    waiver = {"rule": "PZ401", "artifact": "sky", "metric": None, "reason": "none", "until": "2999-12-31"}
    tree["check"]["waivers"].append(waiver)


def worse(errors: dict[str, float]) -> None:
    for metric in errors:
        if metric.endswith("_p99_deg"):
            errors[metric] *= 2.0


def lengthened(file: Path) -> None:
    file.write_bytes(file.read_bytes() + b"x")


def since(edit: Callable[[dict[str, Any]], Any], *, before: bool = False) -> Callable[[Path], None]:
    """An earlier bake beside the scene; one of the two is changed."""

    def fault(scene: Path) -> None:
        shutil.copytree(scene, scene.parent / "before")
        change(scene.parent / "before" if before else scene, edit)
        if before:
            change(scene.parent / "before", lambda m: m.update(sounds=[]))
            change(
                scene.parent / "before",
                lambda m: m.update(streaming=[name for name in m["streaming"] if name in m["artifacts"]]),
            )

    return fault


def lit_by(manifest: dict[str, Any], position: list[float], intensity: float = 1.0) -> None:
    """Gives a scene one light."""
    manifest["lights"] = [light(0.0) | {"position": position, "intensity": intensity}]
    add_light_sets(manifest, {})


def unlit(manifest: dict[str, Any]) -> None:
    lit_by(manifest, [0.0, 1.0, 0.0])
    del manifest["terrain"]["light_sets"]


PLANTED: list[tuple[str, str, Callable[[Path], Any]]] = [
    ("PZ101", "missing file", lambda s: file_of(s, "sky").unlink()),
    ("PZ102", "manifest of another version", manifest(lambda m: m.update(version=1))),
    ("PZ102", "manifest with an unknown key", manifest(lambda m: m.update(extra=1))),
    ("PZ102", "manifest cut short", lambda s: os.truncate(s / "scene.json", 500)),
    ("PZ102", "mesh cut short", cut_mesh),
    ("PZ102", "texture of noise", lambda s: replace(s, "post_color", bytes(range(256)) * 4)),
    ("PZ103", "a file of another hash", manifest(lambda m: m["artifacts"]["sound"].update(sha256="0" * 64))),
    (
        "PZ102",
        "a sound that is cut short",
        lambda s: replace(s, "sound", file_of(s, "sound").read_bytes()[:900]),
    ),
    ("PZ103", "a file that is longer", lambda s: lengthened(file_of(s, "sky"))),
    ("PZ102", "a severity that is none", manifest(lambda m: m["check"]["severity"].update(PZ103="foo"))),
    ("PZ104", "a file of an older bake", lambda s: (s / "sky-00000000.ktx2").write_bytes(b"x")),
    ("PZ201", "index out of range", edit_mesh("indices", put(4, 0, 60000))),
    ("PZ202", "a vertex of NaN", edit_mesh("POSITION", put(3, 1, float("nan")))),
    ("PZ202", "an infinite texture coordinate", edit_mesh("TEXCOORD_0", put(3, 1, float("inf")))),
    ("PZ203", "a normal of length 2", edit_mesh("NORMAL", scale(7, 2.0))),
    ("PZ203", "a normal of length 0", edit_mesh("NORMAL", scale(7, 0.0))),
    ("PZ204", "a tangent along its normal", lean(1.0)),
    ("PZ204", "a tangent against its normal", lean(-1.0)),
    ("PZ204", "a tangent of half the length", edit_mesh("TANGENT", scale(7, 0.5, 3))),
    ("PZ205", "a sign of 0", edit_mesh("TANGENT", put(2, 3, 0.0))),
    *(
        ("PZ206", f"a triangle whose corners {a} and {b} are one", edit_mesh("indices", same_corner(a, b), 2))
        for a, b in ((0, 1), (1, 2), (2, 0))
    ),
    ("PZ207", "levels swapped", swapped_lods),
    ("PZ207", "an error below zero", errors_of_levels(0.0, 0.0, -1.0)),
    ("PZ207", "an error that falls from one level to the next", errors_of_levels(0.0, 0.3, 0.2)),
    ("PZ209", "levels that tell too small an error", modest),
    ("PZ210", "a material elsewhere", measured(lambda m: m["center"].__setitem__(1, m["center"][1] + 0.01))),
    ("PZ210", "textures two percent larger", measured(lambda m: m.update(uv_per_m=m["uv_per_m"] * 0.98))),
    ("PZ210", "textures a tenth smaller", measured(lambda m: m.update(uv_per_m=m["uv_per_m"] * 1.1))),
    ("PZ231", "a coordinate beside the map", edit_mesh("TEXCOORD_0", put(3, 0, 1.5))),
    ("PZ231", "a coordinate before the map", unguarded(edit_mesh("TEXCOORD_0", put(3, 1, -0.01)))),
    ("PZ232", "a layout that is folded", shaded(unguarded(edit_mesh("TEXCOORD_0", folded)))),
    ("PZ233", "a layout whose half is squeezed", unguarded(edit_mesh("TEXCOORD_0", squeezed))),
    ("PZ234", "a ball turned inside out", edit_mesh("indices", turned)),
    ("PZ424", "a light in the sky", manifest(lambda m: lit_by(m, [0.0, 900.0, 0.0]))),
    ("PZ425", "a light of no strength", manifest(lambda m: lit_by(m, [0.0, 1.0, 0.0], 0.0))),
    ("PZ426", "ground without the light above it", manifest(unlit)),
    (
        "PZ427",
        "a sky with another sun",
        lambda s: replace(s, "sky", sunny([0.0, -1.0, 0.1])),
    ),
    ("PZ411", "a path through the hill", manifest(lambda m: lower(m, 3.5))),
    ("PZ412", "a near plane that reaches the ground", manifest(lambda m: m["flight"].update(near_m=4.0))),
    ("PZ501", "a sound that ends in mid-wave", clicking(0.5)),
    ("PZ501", "a sound that ends in the trough of a wave", clicking(-0.5)),
    ("PZ502", "a sound beyond full scale", lambda s: replace(s, "sound", tone(440.0, 1.2))),
    ("PZ503", "a place for a sound of two channels", placed_stereo),
    ("PZ504", "a sound that nobody hears", lambda s: replace(s, "sound", tone(440.0, 0.0005))),
    ("PZ504", "a sound that drowns all others", lambda s: replace(s, "sound", tone(3000.0, 0.99))),
    ("PZ208", "a mesh file without meshes", no_mesh),
    ("PZ301", "the last mip missing", short_chain),
    ("PZ301", "level 0 cut short", cut_texture),
    ("PZ102", "a supercompressed texture whose frame is damaged", packed(no_frame)),
    ("PZ301", "a supercompressed texture that lies about its length", packed(other_length)),
    ("PZ302", "a texel of NaN", nan_sky),
    ("PZ212", "du/dv turned about", turned_dudv),
    ("PZ303", "a normal map in sRGB", color_as_normal),
    ("PZ304", "one level more than a colour has", last_level("post_color", 1)),
    ("PZ304", "many levels more than a repeated map has", last_level("sand_normal", 20)),
    ("PZ304", "one level more than the sky has", last_level("sky", 1)),
    (
        "PZ401",
        "a terrain worse than its budget",
        manifest(lambda m: m["budget"]["hard"].update(terrain_max_m=1e-9)),
    ),
    (
        "PZ401",
        "a path worse than its budget",
        manifest(lambda m: m["budget"]["hard"].update(path_ripple_max=0)),
    ),
    ("PZ406", "a sky worse than its soft budget", manifest(lambda m: soft_budget(m, "sky_max_relative"))),
    ("PZ407", "a waiver that nothing asks for", manifest(idle_waiver)),
    ("PZ421", "an error that doubled", since(lambda m: worse(m["artifacts"]["post_normal"]["errors"]))),
    (
        "PZ421",
        "a level whose error doubled",
        since(lambda m: worse(m["artifacts"]["post_mesh"]["levels"][2])),
    ),
    ("PZ421", "a path that got rougher", since(lambda m: m["flight"]["errors"].update(path_ripple_max=0.3))),
    (
        "PZ422",
        "an artifact that was not there before",
        since(lambda m: m["artifacts"].pop("sound"), before=True),
    ),
    ("PZ423", "a file that was smaller", since(lambda m: m["artifacts"]["sky"].update(bytes=9), before=True)),
    ("PZ402", "an artifact that no pass reads", manifest(lambda m: m.update(sky=None))),
    ("PZ403", "a jump in the camera path", manifest(lambda m: jump(m, "eye", 0.25, 0.0))),
    ("PZ403", "a jump in where the camera looks", manifest(lambda m: jump(m, "target", 0.25, 0.0))),
    ("PZ403", "a jolt in the camera path", manifest(lambda m: jump(m, "eye", 0.0, 0.01))),
    ("PZ403", "a jolt in where the camera looks", manifest(lambda m: jump(m, "target", 0.0, 0.01))),
]


def test_a_supercompressed_texture_has_no_fault(scene: Path) -> None:
    packed()(scene)
    assert not [f for f in check_paths([scene]) if f.severity == "error"]


def test_a_sound_scene_is_clean(sound_scene: Path) -> None:
    options = CheckOptions()
    assert check_paths([sound_scene], options) == []
    assert len(options.checked) == len(json.loads((sound_scene / "scene.json").read_text())["artifacts"])
    assert check_paths([sound_scene / "scene.json"]) == []
    assert check_paths([path for path in sound_scene.iterdir() if path.suffix in (".glb", ".ktx2")]) == []


def test_a_turned_part_that_is_drawn_from_both_sides_has_no_fault(scene: Path) -> None:
    edit_mesh("indices", turned)(scene)
    change(scene, lambda m: m["objects"][0]["materials"]["wood"].update(two_sided=True))
    assert check_paths([scene]) == []


OF_RULES = [[planted for planted in PLANTED if planted[0] == code] for code in {c for c, _, _ in PLANTED}]
# Of each rule the first fault, and of one with more than two the last, which is another kind.
QUICK = [faults[0] for faults in OF_RULES]
QUICK += [faults[-1] for faults in OF_RULES if len(faults) > 2]
# Found by a comparison of their own.
OWN = {
    "manifest with an unknown key",
    "an infinite texture coordinate",
    "a normal of length 0",
    "a tangent against its normal",
    "a triangle whose corners 1 and 2 are one",
    "a coordinate before the map",
    "a sound that drowns all others",
    "many levels more than a repeated map has",
    "a path worse than its budget",
    "a level whose error doubled",
}
QUICK += [planted for planted in PLANTED if planted[1] in OWN]


@pytest.mark.parametrize(
    ("code", "fault", "plant"), sweep(PLANTED, test=QUICK), ids=[f"{c}-{f}" for c, f, _ in PLANTED]
)
def test_the_rule_fires_and_no_other_error_does(
    scene: Path, code: str, fault: str, plant: Callable[[Path], Any]
) -> None:
    plant(scene)
    before = scene.parent / "before"
    findings = check_paths([scene], CheckOptions(against=before if before.exists() else None))
    assert code in {finding.code for finding in findings}, findings
    assert {finding.code for finding in findings if finding.severity == "error"} <= {code}, findings


@pytest.mark.parametrize(
    "edit",
    [
        lambda m: m.update(center=["here", 0, 0]),
        lambda m: m.update(center=None),
        lambda m: m.update(center=0.0),
        lambda m: m.pop("center"),
        lambda m: m.pop("uv_per_m"),
        lambda m: m.update(uv_per_m="much"),
        lambda m: m.update(uv_per_m=-1.0),
        lambda m: m.clear(),
    ],
)
def test_what_a_material_does_not_say_as_numbers_is_found(scene: Path, edit: Callable[[Any], None]) -> None:
    measured(edit)(scene)
    findings = check_paths([file_of(scene, "post_mesh")])
    assert {finding.code for finding in findings} == {"PZ210"}
    with pytest.raises(FormatError):
        decode_glb(file_of(scene, "post_mesh").read_bytes())


def test_textures_denser_than_a_file_may_say_are_no_fault(tmp_path: Path) -> None:
    places, corners = "v 0 0 0\nv 1e-33 0 0\nv 0 1e-33 0\n", "vt 0 0\nvt 1 0\nvt 0 1\n"
    (tmp_path / "tiny.obj").write_text(f"{places}{corners}f 1/1 2/2 3/3\n")
    (tmp_path / "tiny.glb").write_bytes(bake_mesh(tmp_path / "tiny.obj", MeshSettings(lods=1)).glb)
    assert check_paths([tmp_path / "tiny.glb"]) == []


def test_the_last_level_that_there_is_may_be_read(scene: Path) -> None:
    last_level("post_color", 0)(scene)
    assert check_paths([scene]) == []


def test_an_error_beyond_reckoning_hides_no_other(scene: Path) -> None:
    def edit(manifest: dict[str, Any]) -> None:
        manifest["artifacts"]["sand_color"]["errors"]["color_psnr_db"] = -1e30
        worse(manifest["artifacts"]["post_normal"]["errors"])

    since(edit)(scene)
    found = check_paths([scene], CheckOptions(against=scene.parent / "before"))
    assert {"sand_color", "post_normal"} <= {one.artifact for one in found if one.code == "PZ421"}
    assert "PZ105" not in {one.code for one in found}


def test_a_loud_high_tone_that_loops_is_clean() -> None:
    """From its last sample to its first it steps as it does everywhere; a hush hides any step."""
    assert list(check_sound(tone(440.0, 0.4), "a.ogg")) == []
    assert list(check_sound(tone(110.25, 0.01), "a.ogg")) == []


def test_every_rule_has_a_planted_fault() -> None:
    from tests.pipeline.bakers.terrain.test_tiles import TILE_FAULTS
    from tests.pipeline.build.measurements.test_gutters import GUTTER_FAULTS
    from tests.pipeline.checks.test_maps import MAP_FAULTS

    planted = {code for code, _, _ in (*PLANTED, *GUTTER_FAULTS, *MAP_FAULTS, *TILE_FAULTS)}
    # Not there: a fault of the checker (test_hostile.py), and of a scene's TOML (test_settings.py).
    assert planted == set(RULES) - {"PZ105", "PZ431"}


def test_a_thousand_equal_findings_are_one_line_with_a_count(scene: Path) -> None:
    replace(
        scene,
        "post_mesh",
        with_accessor(file_of(scene, "post_mesh").read_bytes(), "NORMAL", lambda a: np.multiply(a, 3, out=a)),
    )
    findings = [finding for finding in check_paths([scene]) if finding.code == "PZ203"]
    assert len(findings) == 1 and findings[0].count > 50 and f"({findings[0].count} such)" in str(findings[0])
    many = [Finding("PZ102", "a.glb", "same", f"place {k}") for k in range(1000)]
    assert [(f.count, f.place) for f in gathered(many)] == [(1000, "place 0")]


@pytest.mark.parametrize(
    "data", [b"", b"glTF", b"glTF\2\0\0\0\x10\0\0\0", b"\xabKTX 20\xbb\r\n\x1a\n", os.urandom(300)]
)
@pytest.mark.parametrize("name", ["x.glb", "x.ktx2", "scene.json", "x.bin"])
def test_no_bytes_break_the_checker(tmp_path: Path, name: str, data: bytes) -> None:
    (tmp_path / name).write_bytes(data)
    findings = check_paths([tmp_path / name])
    assert [finding.code for finding in findings] == ["PZ102"]


def test_cut_meshes_and_textures_are_found_at_every_length(scene: Path, tmp_path: Path) -> None:
    for name in ("post_mesh", "post_gloss"):
        path = file_of(scene, name)
        data = path.read_bytes()
        for k in range(0, len(data), max(1, len(data) // 40)):
            cut = tmp_path / f"cut{path.suffix}"
            cut.write_bytes(data[:k])
            assert check_paths([cut]), (name, k)


@pytest.mark.parametrize(
    "tree",
    [
        {"asset": {"version": "2.0"}},
        {"nodes": [{"name": "a"}], "meshes": [{"primitives": []}]},
        {"nodes": [{"mesh": 0}], "meshes": [{"primitives": []}]},
    ],
)
def test_a_mesh_file_without_any_mesh_is_a_warning(tmp_path: Path, tree: dict[str, Any]) -> None:
    (tmp_path / "a.glb").write_bytes(bare_glb(tree))
    found = check_paths([tmp_path / "a.glb"])
    assert [(finding.code, finding.severity) for finding in found] == [("PZ208", "warning")]


def test_a_path_that_is_not_there_is_a_finding(tmp_path: Path) -> None:
    assert [f.code for f in check_paths([tmp_path / "gone", tmp_path])] == ["PZ101", "PZ101"]


def test_all_formats_tell_the_same_findings(scene: Path) -> None:
    file_of(scene, "sky").unlink()
    (scene / "sky-00000000.ktx2").write_bytes(b"x")
    findings = check_paths([scene])
    assert [f.severity for f in findings] == ["error", "warning"]
    assert "PZ101" in render(findings, "text") and "1 error, 1 warning" in render(findings, "text")
    tree = json.loads(render(findings, "json"))
    assert (tree["errors"], tree["warnings"]) == (1, 1) and tree["findings"][0]["code"] == "PZ101"
    suite = ElementTree.fromstring(render(findings, "junit"))
    assert suite.attrib["failures"] == "1" and len(suite) == len(RULES) == int(suite.attrib["tests"])
    sarif = json.loads(render(findings, "sarif"))
    (run,) = sarif["runs"]
    assert sarif["version"] == "2.1.0" and [r["ruleId"] for r in run["results"]] == ["PZ101", "PZ104"]
    assert {rule["id"] for rule in run["tool"]["driver"]["rules"]} == set(RULES)
    assert render([], "text", 1) == "1 artifact checked: no finding"
    assert render(findings, "text", 19).endswith("19 artifacts checked: 1 error, 1 warning")


def test_findings_survive_odd_names_in_xml() -> None:
    finding = Finding("PZ102", 'a<b>&"c".glb', "what <is> & this")
    assert ElementTree.fromstring(render([finding], "junit")).attrib["failures"] == "1"
