"""Boxes in a row, each with a colour map of its own, and a flight that passes close by them."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tests.player.synthetic import identity, instance, material, write_scene


def row_of_boxes(
    folder: Path, maps: Iterable[bytes], *, spacing_m: float, seconds: float, unused: Iterable[bytes] = ()
) -> Path:
    """maps: KTX2 of each box. seconds: of the flight, which comes near enough to each for mip 0. unused: KTX2
    of cube maps that nothing refers to."""
    scene = write_scene(folder, bare=True)
    manifest: dict[str, Any] = json.loads((scene / "scene.json").read_text())
    entry, box = manifest["artifacts"].pop("box_color"), manifest["objects"][0]

    def put(name: str, data: bytes, **changes: str) -> None:
        (scene / f"{name}.ktx2").write_bytes(data)
        manifest["artifacts"][name] = entry | {"file": f"{name}.ktx2"} | identity(data) | changes

    manifest["objects"] = []
    for i, data in enumerate(maps):
        put(f"color{i}", data)
        wood = material(f"color{i}")
        manifest["objects"].append(
            box
            | {
                "name": f"box{i}",
                "materials": {"wood": wood, "leaf": wood | {"two_sided": True}},
                "instances": [instance([spacing_m * i, 0.0, 0.0], 0.4)],
            }
        )
    for i, data in enumerate(unused):
        put(f"unused{i}", data, kind="cubemap")
    along = [0.0, spacing_m * (len(manifest["objects"]) - 1), 0.0, 0.0]
    manifest["flight"] |= {
        "duration_s": seconds,
        "fov_rad": 0.06,
        "segments": [
            {
                "eye": [along, [1.0, 0.0, 0.0, 0.0], [5.0, 0.0, 0.0, 0.0]],
                "target": [along, [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]],
                "roll": [0.0, 0.0, 0.0, 0.0],
            }
        ],
        "time_table": [[0.0, 0.0, 1 / seconds], [seconds, 1.0, 1 / seconds]],
    }
    manifest["artifacts"] = dict(sorted(manifest["artifacts"].items()))
    manifest["streaming"] = sorted(manifest["artifacts"])
    (scene / "scene.json").write_text(json.dumps(manifest))
    return scene
