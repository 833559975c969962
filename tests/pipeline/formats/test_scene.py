"""scene.json: what its reader refuses, and the place that it names."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

import pytest

from paradize.errors import FormatError
from paradize.formats.scene.manifest import decode_scene, map_sets
from paradize.player_limits import LARGEST_M
from tests.places import ROOT
from tests.player.synthetic import write_scene

Change = Callable[[dict[str, Any]], object]


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    return (write_scene(tmp_path_factory.mktemp("scene"), bare=True) / "scene.json").read_text()


@pytest.fixture
def manifest(text: str) -> dict[str, Any]:
    manifest: dict[str, Any] = json.loads(text)
    return manifest


def refusal(manifest: dict[str, Any]) -> str:
    with pytest.raises(FormatError) as refused:
        decode_scene(json.dumps(manifest).encode())
    return str(refused.value)


def test_another_version_is_refused_with_what_to_do(manifest: dict[str, Any]) -> None:
    message = refusal(manifest | {"version": 3})
    assert "version" in message and "3" in message and "10" in message
    assert "bake it again" in message


def wood(tree: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = tree["objects"][0]["materials"]["wood"]
    return found


def box(tree: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = tree["objects"][0]["instances"][0]
    return found


@pytest.mark.parametrize(
    "change, place",
    [
        (lambda m: m["objects"][0].update(radius_m=1.001e7), "objects[0].radius_m"),
        (lambda m: m["objects"][0]["lods"][0].update(error_m=1.001e7), "objects[0].lods[0].error_m"),
        (lambda m: wood(m)["maps"].update(normal="no_such"), "objects[0].materials.wood.maps.normal"),
        (lambda m: wood(m)["maps"].update(color="box_mesh"), "objects[0].materials.wood.maps.color"),
        (lambda m: wood(m)["maps"].pop("emission"), "objects[0].materials.wood.maps.emission"),
        (lambda m: wood(m)["maps"].update(shine=None), "objects[0].materials.wood.maps.shine"),
        (lambda m: wood(m).update(alpha_mode="glass"), "objects[0].materials.wood.alpha_mode"),
        (lambda m: wood(m).update(alpha_mode=["mask"]), "objects[0].materials.wood.alpha_mode"),
        (lambda m: wood(m).update(metalness=1.5), "objects[0].materials.wood.metalness"),
        (lambda m: wood(m).update(emission=[1.0, -1.0, 0.0]), "objects[0].materials.wood.emission[1]"),
        (lambda m: wood(m).pop("opacity"), "objects[0].materials.wood.opacity"),
        (lambda m: box(m).update(rotation=[0.0, 0.0, 0.0, 0.5]), "objects[0].instances[0].rotation"),
        (lambda m: box(m).update(rotation=[0.0, 0.0, 1.0]), "objects[0].instances[0].rotation"),
        (lambda m: box(m).update(scale=[1.0, 0.0, 1.0]), "objects[0].instances[0].scale[1]"),
        (lambda m: box(m).update(scale=2.0), "objects[0].instances[0].scale"),
        (lambda m: box(m).update(yaw_rad=0.0), "objects[0].instances[0].yaw_rad"),
        (lambda m: m.update(vram_mb=0.5), "vram_mb"),
    ],
)
def test_a_bad_material_or_instance_is_refused_by_its_place(
    manifest: dict[str, Any], change: Change, place: str
) -> None:
    change(manifest)
    assert place in refusal(manifest)


def test_a_limit_of_device_memory_may_stand_in_the_manifest_or_not(manifest: dict[str, Any]) -> None:
    assert "vram_mb" not in decode_scene(json.dumps(manifest).encode())
    assert decode_scene(json.dumps(manifest | {"vram_mb": 256.0}).encode())["vram_mb"] == 256.0


def test_a_mirrored_instance_and_thousands_of_them_are_read(manifest: dict[str, Any]) -> None:
    one = box(manifest) | {"scale": [-1.0, 2.0, 0.5]}
    manifest["objects"][0]["instances"] = [one] * 20_000
    assert decode_scene(json.dumps(manifest).encode())["objects"][0]["instances"][-1] == one


def test_an_object_of_a_manifest_may_have_as_many_instances_as_the_player_takes(
    manifest: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("paradize.player_limits.MOST_INSTANCES", 3)
    manifest["objects"][0]["instances"] = [box(manifest)] * 3
    decode_scene(json.dumps(manifest).encode())
    manifest["objects"][0]["instances"] *= 2
    assert "objects[0].instances" in refusal(manifest)


def test_materials_with_the_same_maps_used_alike_are_one_set(manifest: dict[str, Any]) -> None:
    (item,) = manifest["objects"]
    ((_, names),) = map_sets(item)
    assert names == {"wood", "leaf"}
    wood(manifest)["wrap"] = None
    assert sorted(sorted(names) for _, names in map_sets(item)) == [["leaf"], ["wood"]]


def test_the_largest_mesh_is_the_largest_that_the_player_takes() -> None:
    text = (ROOT / "player/assets/limits.hpp").read_text()
    (limit,) = re.findall(r"constexpr double max_length_m = (\S+);", text)
    assert float(limit) == LARGEST_M


@pytest.mark.parametrize(
    ("text", "kind"), [("[1]", "a list"), ("5", "a number"), ('"a"', "a text"), ("null", "null")]
)
def test_json_that_is_no_object_is_named(text: str, kind: str) -> None:
    with pytest.raises(FormatError, match=f"scene.json: .* it holds {kind}, not an object; bake it again"):
        decode_scene(text.encode())
