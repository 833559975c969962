"""`new` makes an object with a file of instances of what a glTF shows at many places."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize import player_limits
from paradize.errors import SourceError
from paradize.new.instances import instance_of
from paradize.new.model import copy_model
from paradize.new.scene import new_scene
from paradize.new.shapes import Shape, least_floor
from paradize.placement import to_world
from paradize.readers.model import read_model
from paradize.scene.placement import placed
from paradize.scene.settings import Scene, load_scene
from tests.pipeline.readers.gltf.made import PNG, SQUARE, TWO, Made, square

INSTANCING = "EXT_mesh_gpu_instancing"
HALF = 0.5**0.5
# Turns that angles alone tell badly: none, a half, and pitches of 90 degrees up and down, rolled.
TURNS = [[0, 0, 0, 1], [0, 0, 1, 0], [HALF, 0, 0, HALF], [-0.5, 0.5, 0.5, 0.5], [0, -HALF, HALF, 0]]


def instancing(made: Made, **attributes: Any) -> dict[str, Any]:
    numbers = {name: made.array(np.float32(rows)) for name, rows in attributes.items()}
    return {INSTANCING: {"attributes": numbers}}


def meadow(rest: bool = True) -> Made:
    """Blades that two nodes show 37 and 5 times, the second mirrored, on a slab that is shown once."""
    made, primitive = square(TEXCOORD_0=np.float32([[0, 0], [1, 0], [1, 1], [0, 1]]))
    picture = {"bufferView": made.view(PNG), "mimeType": "image/png"}
    texture = made.add("textures", source=made.add("images", **picture))
    color = {"baseColorTexture": {"index": texture}}
    primitive["material"] = made.add("materials", name="green", pbrMetallicRoughness=color)
    blade = made.mesh(primitive, name="blade")
    random = np.random.default_rng(7)
    turns = random.normal(size=(37, 4))
    turns[: len(TURNS)] = TURNS
    turns /= np.sqrt((turns * turns).sum(axis=1, keepdims=True))
    sizes = random.uniform(0.2, 3.0, (37, 3)) * random.choice([-1, 1], (37, 3))
    many = instancing(made, TRANSLATION=random.uniform(-20, 20, (37, 3)), ROTATION=turns, SCALE=sizes)
    few = instancing(made, TRANSLATION=random.uniform(-9, 9, (5, 3)))
    nodes = [
        made.add("nodes", mesh=blade, extensions=many, translation=[1, 2, 3], scale=[0.1] * 3),
        made.add("nodes", mesh=blade, extensions=few, rotation=[0, HALF, 0, HALF], scale=[-2, 2, 2]),
    ]
    if rest:
        slab = made.mesh({"attributes": {"POSITION": made.array(30 * SQUARE)}, "indices": made.array(TWO)})
        nodes.append(made.add("nodes", mesh=slab, name="slab", rotation=[-HALF, 0, 0, HALF]))
    made.show(*nodes)
    made.tree |= {"extensionsUsed": [INSTANCING], "extensionsRequired": [INSTANCING]}
    return made


def corners(path: Path) -> Any:
    """(m, 3, 3) float64, the positions of the file."""
    model = read_model(path)
    return model.source.positions[model.mesh.triangles]


def drawn(scene: Scene) -> Any:
    """The triangles of a scene's objects, as the player draws them."""
    out = []
    for item in scene.objects:
        places = np.moveaxis(corners(item.mesh), -1, 0)
        for one in map(placed, item.instances):
            flip = -1 if np.prod(one["scale"]) < 0 else 1  # as the player turns them
            out.append(np.stack(to_world(places, one), axis=-1)[:, ::flip])
    return np.concatenate(out)


def ordered(triangles: Any) -> Any:
    """Triangles in an order of their own: by their middles."""
    return triangles[np.lexsort(np.round(triangles.mean(axis=1), 4).T)]


def test_every_copy_stands_where_the_file_has_it(tmp_path: Path) -> None:
    """Within 1e-9 of the model's radius: the places have eleven digits. Mirrored copies face outwards."""
    source = meadow().glb(tmp_path / "Meadow.glb")
    new = new_scene(tmp_path / "s", source)
    scene = load_scene(new.scene)
    rest, blade = scene.objects
    assert (rest.name, blade.name) == ("meadow", "blade")
    assert len(rest.instances) == 1 and len(blade.instances) == 42 and blade.instances_file
    assert (new.position, new.scale) == (rest.instances[0].position, 1.0)
    assert len(read_model(rest.mesh).mesh.triangles) == len(read_model(blade.mesh).mesh.triangles) == 2
    wanted = corners(source) + rest.instances[0].position
    assert len(wanted) == 2 * 43
    found, wanted = ordered(drawn(scene)), ordered(wanted)
    assert np.abs(found - wanted).max() < 1e-9 * np.abs(wanted).max()
    assert not new.notes
    assert new.taken == ["42 copies of 'blade' are instances of the object blade, listed in model/blade.csv"]


def test_a_model_of_copies_alone_is_one_object(tmp_path: Path) -> None:
    source = meadow(rest=False).gltf(tmp_path / "meadow.gltf")
    new = new_scene(tmp_path / "s", source)
    (item,) = load_scene(new.scene).objects
    assert item.name == "blade" and len(item.instances) == 42
    assert [name for name in new.files if name.startswith("model/")] == [
        "model/blade.csv",
        "model/blade.gltf",
    ]


def test_size_floor_cameras_and_sun_are_those_of_the_copied_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To float32, in which the copied model has its triangles."""
    made = meadow()
    made.add("cameras", type="perspective", perspective={"yfov": 0.6, "znear": 0.1})
    made.show(*made.tree["scenes"][0]["nodes"], made.add("nodes", camera=0, translation=[9, 9, 60]))
    source = made.glb(tmp_path / "a.glb")
    for name in ("s/model", "t/model"):
        (tmp_path / name).mkdir(parents=True)
    split = copy_model(source, tmp_path / "s")
    monkeypatch.setattr(player_limits, "MOST_INSTANCES", 20)
    copied = copy_model(source, tmp_path / "t")
    assert [part.table for part in copied.parts] == [""]
    assert any("42 copies of 'blade' are no instances: a scene has at most 20" in one for one in copied.notes)
    assert np.allclose(split.center, copied.center, atol=1e-5)
    assert split.radius == pytest.approx(copied.radius, rel=1e-6)
    assert split.foot == pytest.approx(copied.foot, rel=1e-6)
    assert split.floor == pytest.approx(copied.floor, rel=1e-6)
    assert split.views == copied.views and split.views and split.views.cameras


@pytest.mark.parametrize("turn", [-HALF, HALF])
def test_mirrored_copies_face_up_as_they_are_drawn(turn: float, tmp_path: Path) -> None:
    """Tiles a metre above a square that stands upright: a floor where they show their front from above."""
    made, primitive = square()
    tile = made.mesh(primitive)
    places = [[x, 1, 0] for x in range(3)]
    copies = instancing(made, TRANSLATION=places, ROTATION=[[turn, 0, 0, HALF]] * 3, SCALE=[[-1, 1, 1]] * 3)
    made.show(made.add("nodes", mesh=tile), made.add("nodes", mesh=tile, extensions=copies))
    source = made.glb(tmp_path / "a.glb")
    (tmp_path / "s/model").mkdir(parents=True)
    split = copy_model(source, tmp_path / "s")
    wanted = pytest.approx(1.0) if turn < 0 else None
    assert len(split.parts) == 2 and split.floor == wanted
    assert least_floor([Shape.of(read_model(source).mesh)]) == wanted


def test_a_model_that_is_shown_smaller_has_no_instance_below_its_least_scale(tmp_path: Path) -> None:
    """A mesh in millimetres, in a model of 3,000 km: a millionth of a scale and a half would be left."""
    made = meadow()
    made.tree["nodes"][0] |= {"scale": [1e-3] * 3}
    made.tree["nodes"][1] |= {"scale": [1e-3] * 3}
    made.show(made.add("nodes", children=[0, 1, 2], scale=[1e5] * 3))
    source = made.glb(tmp_path / "a.glb")
    scene = load_scene(new_scene(tmp_path / "s", source).scene)
    rest, blade = scene.objects
    assert rest.instances[0].scale < 1e-6 * 1e3 and len(blade.instances) == 42  # type: ignore[operator]
    wanted = corners(source) * rest.instances[0].scale + rest.instances[0].position
    assert np.abs(ordered(drawn(scene)) - ordered(wanted)).max() < 1e-9


@pytest.mark.parametrize(
    ("node", "why"),
    [
        ({"scale": [0.1, 0.2, 0.1]}, "of them are sheared or flat"),
        ({"scale": [0.1, 0.0, 0.1]}, "37 of them are sheared or flat"),
    ],
)
def test_copies_that_no_instance_can_be_stay_triangles_and_are_named(
    node: dict[str, Any], why: str, tmp_path: Path
) -> None:
    made = meadow()
    made.tree["nodes"][0] |= node
    made.tree["nodes"].pop(1)
    made.show(0, 1)
    new = new_scene(tmp_path / "s", made.glb(tmp_path / "a.glb"))
    (item,) = load_scene(new.scene).objects
    assert item.mesh.name == "a.glb" and not item.instances_file and not new.taken
    assert "copies of 'blade' are no instances: " in new.notes[0] and why in new.notes[0]
    assert "37 copies become triangles" in new.notes[1]


def test_copies_of_size_0_are_left_out_and_tiny_ones_are_triangles(tmp_path: Path) -> None:
    made, primitive = square()
    sizes = [[1, 1, 1], [0, 0, 0], [2, 2, 2]]
    node = {"mesh": made.mesh(primitive), "extensions": instancing(made, SCALE=sizes)}
    made.show(made.add("nodes", **node))
    scene = load_scene(new_scene(tmp_path / "s", made.glb(tmp_path / "a.glb")).scene)
    (item,) = scene.objects
    assert item.name == "a_copies" and [one.scale for one in item.instances] == [(0.5,) * 3, (1.0,) * 3]
    made.tree["nodes"][0]["extensions"] = instancing(made, SCALE=[[1, 1, 1], [1e-7, 1e-7, 1e-7]])
    new = new_scene(tmp_path / "t", made.glb(tmp_path / "a.glb"))
    assert "they are 1e-07 to 1 times as large as their mesh" in new.notes[0]


def test_of_very_many_meshes_some_stay_triangles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = meadow()
    blade, slab = made.tree["nodes"][0], made.tree["nodes"][2]
    slab["extensions"] = blade["extensions"]
    monkeypatch.setattr("paradize.new.model._MOST_SPLIT", 1)
    (tmp_path / "s/model").mkdir(parents=True)
    model = copy_model(made.glb(tmp_path / "a.glb"), tmp_path / "s")
    assert [part.name for part in model.parts] == ["a", "blade"]
    assert "the 37 copies of 'slab' are no instances: at most 1 meshes become objects" in model.notes[0]
    assert "37 copies become triangles" in model.notes[1]


def test_copies_too_many_to_unfold_are_refused_with_the_command_that_shows_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, primitive = square()
    places = made.add("accessors", componentType=5126, count=500, type="VEC3")  # all at the origin
    several = {INSTANCING: {"attributes": {"TRANSLATION": places}}}
    made.show(made.add("nodes", mesh=made.mesh(primitive), extensions=several))
    model = made.glb(tmp_path / "a.glb")
    monkeypatch.setattr("paradize.readers.gltf.document._SPARE_VALUES", 2000)
    with pytest.raises(SourceError, match="copies unfold to more than") as caught:
        read_model(model)
    assert "`paradize new FOLDER --from FILE` makes a scene" in str(caught.value.mend)
    (item,) = load_scene(new_scene(tmp_path / "s", model).scene).objects
    assert len(item.instances) == 500


def test_children_and_other_meshes_of_the_file_stay_where_they_are(tmp_path: Path) -> None:
    """A child of a node with instances is shown once, as the extension says."""
    made, primitive = square()
    mesh = made.mesh(primitive)
    child = made.add("nodes", mesh=mesh, translation=[0, 5, 0])
    several = instancing(made, TRANSLATION=[[0, 0, 0], [9, 0, 0]])
    made.show(made.add("nodes", mesh=mesh, extensions=several, children=[child], name="a.glb"))
    source = made.glb(tmp_path / "a.glb")
    scene = load_scene(new_scene(tmp_path / "s", source).scene)
    assert [one.name for one in scene.objects] == ["a", "a_glb"]
    wanted = corners(source) + scene.objects[0].instances[0].position
    assert np.abs(ordered(drawn(scene)) - ordered(wanted)).max() < 1e-9


def test_the_objects_share_the_bytes_of_the_model_and_keep_its_materials(tmp_path: Path) -> None:
    """The same files each time. A file beside that has the name of one to write keeps it."""
    made = meadow(rest=True)
    glb = made.glb(tmp_path / "a.glb")
    first, again = (new_scene(tmp_path / name, glb) for name in ("s", "t"))
    names = [name for name in first.files if name.startswith("model/")]
    assert names == ["model/a.bin", "model/a.gltf", "model/blade.csv", "model/blade.gltf"]
    for name in names:
        assert (tmp_path / "s" / name).read_bytes() == (tmp_path / "t" / name).read_bytes()
    blade = read_model(tmp_path / "s/model/blade.gltf")
    assert blade.libraries == [tmp_path / "s/model/a.bin"] and not blade.warnings
    assert blade.materials["green"].maps["color"].picture.data == PNG
    assert INSTANCING not in (tmp_path / "s/model/a.gltf").read_text()
    (tmp_path / "beside").mkdir()
    (tmp_path / "beside/blade.csv").write_bytes(bytes(made.data))
    beside = new_scene(tmp_path / "u", made.gltf(tmp_path / "beside/a.gltf", "blade.csv"))
    names = [name for name in beside.files if name.startswith("model/")]
    assert names == ["model/a.gltf", "model/blade.csv", "model/blade.gltf", "model/blade_.csv"]
    assert len(load_scene(beside.scene).objects[1].instances) == 42
    assert json.loads((tmp_path / "u/model/a.gltf").read_text())["buffers"][0]["uri"] == "blade.csv"
    assert again.taken == first.taken


@pytest.mark.parametrize("turn", TURNS)
def test_an_instance_is_read_back_from_its_matrix(turn: list[float]) -> None:
    x, y, z, w = turn
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    for sizes in ([2.0, 3.0, 4.0], [2.0, -3.0, 4.0]):
        scaled = np.array(rows) * sizes
        found = instance_of(np.concatenate([scaled, [[7], [8], [9]]], axis=1).ravel().tolist())
        assert found is not None
        back = np.stack(to_world(np.eye(3), placed(found)))
        assert np.abs(back - scaled - [[7], [8], [9]]).max() < 1e-14
