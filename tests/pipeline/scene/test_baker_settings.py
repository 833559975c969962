"""The settings of the bakers: said once, taken over by name from a scene and from the command line."""

from __future__ import annotations

import json
import re
from argparse import Namespace
from dataclasses import FrozenInstanceError, asdict, fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from paradize.build.materials.map_sets import find_map_sets
from paradize.cli import maps, mesh, terrain
from paradize.cli.main import main
from paradize.scene import baker_settings
from paradize.scene.baker_settings import (
    AuthoredSettings,
    BakerSettings,
    ColorSettings,
    CubemapSettings,
    MapSettings,
    MeshSettings,
    TerrainSettings,
    TextureSettings,
    TileSettings,
)
from paradize.scene.requirements import require
from paradize.scene.settings import Relief, load_scene
from tests.pipeline.scenes import make_cove

BAKERS: dict[str, type[BakerSettings]] = {
    "mesh": MeshSettings,
    "terrain": TileSettings,
    "color": ColorSettings,
    "maps": MapSettings,
    "cubemap": CubemapSettings,
}
ALL = [*BAKERS.values(), AuthoredSettings, TerrainSettings, TextureSettings]


@pytest.mark.parametrize("kind", ALL)
def test_settings_are_frozen_named_and_documented(kind: type[BakerSettings]) -> None:
    with pytest.raises(TypeError):
        kind((1.0, 1.0))  # type: ignore[call-arg]
    made = kind(size_m=(1.0, 1.0)) if issubclass(kind, TerrainSettings) else kind()
    with pytest.raises(FrozenInstanceError):
        setattr(made, fields(kind)[0].name, None)
    relief = {one.name for one in fields(Relief)}  # documented in FIELDS.md
    message = " ".join(
        str(base.__doc__) for base in kind.__mro__ if base.__module__ == baker_settings.__name__
    )
    missing = {one.name for one in fields(kind)} - relief - set(re.findall(r"[a-z_]+", message))
    assert not missing


def test_settings_take_what_bears_their_names_and_nothing_else() -> None:
    given = SimpleNamespace(strength=7.0, gamma=2.0, unknown=1, wrap="repeat")
    assert MapSettings.of(given, wrap="clamp") == MapSettings(strength=7.0, gamma=2.0)


def test_every_job_of_a_scene_holds_all_settings_of_its_baker(tmp_path: Path) -> None:
    """As JSON, which is how they are hashed and told."""
    path = make_cove(tmp_path)
    scene = load_scene(path)
    seen = set()
    for job in require(scene, find_map_sets(scene, path).maps).jobs:
        if job.baker in BAKERS:
            made = BAKERS[job.baker](**job.settings)
            assert json.loads(json.dumps(asdict(made))) == json.loads(json.dumps(job.settings)), job.name
            seen.add(job.baker)
    assert seen == BAKERS.keys()


@pytest.mark.parametrize(
    ("command", "words", "settings"),
    [
        (mesh, "mesh a.obj -o a.glb --ratio 0.25 --weld 0.5 --crease 30", {"lod_ratio": 0.25, "weld_m": 0.5}),
        (mesh, "mesh a.obj -o a.glb --errors 0.1,0.2 --quantise", {"lod_errors": (0.1, 0.2), "quantise": {}}),
        (mesh, "mesh a.obj -o a.glb --screen-size 64", {"screen_size": {"size_px": 64.0}}),
        (maps, "maps a.png -o m --zstd 3 --gamma 2 --destep", {"zstd": 3, "gamma": 2.0, "destep": True}),
        (
            maps,
            "maps a.png -o m --from height --filter fourth --gloss-groups a,b --uv a.obj",
            {"source": "height", "filter": "fourth", "gloss_groups": ["a", "b"]},
        ),
        (
            terrain,
            "terrain a.png -o t.glb --size 3 4 --height 5 --scale 2 --max-error 0.5 --nodata 7",
            {"size_m": (3.0, 4.0), "height_m": 5.0, "height_scale": 2.0, "max_error_m": 0.5, "nodata": 7.0},
        ),
    ],
)
def test_the_options_of_a_command_reach_its_baker(
    monkeypatch: pytest.MonkeyPatch, command: Any, words: str, settings: dict[str, Any]
) -> None:
    found: list[BakerSettings] = []

    def spy(_: Namespace, kind: str, given: BakerSettings, *__: Any, **___: Any) -> int:
        assert kind == words.split()[0]
        found.append(given)
        return 0

    monkeypatch.setattr(command, "bake_file", spy)
    assert main(words.split()) == 0
    result = asdict(found[0])
    assert {name: result[name] for name in settings} == settings
