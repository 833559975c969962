"""Readers that others wrote judge what the island's bake leaves."""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

from paradize.formats.ktx2.reader import decode_ktx2


def test_khronos_validator_finds_nothing_in_any_glb(island: Path, node: Callable[..., Any]) -> None:
    files = sorted(island.glob("*.glb"))
    assert files
    results = node("validate_gltf.mjs", files)
    assert {file: r for file, r in results.items() if r["errors"] or r["warnings"]} == {}
    assert len(results) == len(files)


def test_ktx_parse_reads_every_ktx2_as_we_do(island: Path, node: Callable[..., Any]) -> None:
    files = sorted(island.glob("*.ktx2"))
    assert files
    results = node("read_ktx2.mjs", files)
    for file in files:
        ours = decode_ktx2(file.read_bytes(), file)
        theirs = results[str(file)]
        assert (theirs["width"], theirs["height"]) == (ours.width, ours.height), file
        assert theirs["faces"] == ours.faces, file
        assert theirs["levels"] == [len(level) for level in ours.levels], file
        assert theirs["vkFormat"] == int.from_bytes(file.read_bytes()[12:16], "little"), file


def test_every_mip_chain_ends_at_one_texel(island: Path) -> None:
    for file in sorted(island.glob("*.ktx2")):
        texture = decode_ktx2(file.read_bytes(), file)
        assert len(texture.levels) == max(texture.width, texture.height).bit_length(), file


def test_scene_json_names_exactly_the_files_that_stand_beside_it(island: Path) -> None:
    scene = json.loads((island / "scene.json").read_text())
    named = {entry["file"]: entry for entry in scene["artifacts"].values()}
    assert set(named) | {"scene.json"} == {path.name for path in island.iterdir()}
    for name, entry in named.items():
        data = (island / name).read_bytes()
        assert entry["bytes"] == len(data)
        assert entry["sha256"] == hashlib.sha256(data).hexdigest()


def test_every_artifact_states_its_tier_and_a_measured_error(island: Path) -> None:
    scene = json.loads((island / "scene.json").read_text())
    for name, entry in scene["artifacts"].items():
        assert entry["tier"] in {"fast", "balanced", "exact"}, name
        if entry["kind"] != "sound":
            assert entry["errors"], f"{name} states no error"


def test_a_second_bake_bakes_nothing_and_says_so(
    island: Path, paradize: Callable[..., subprocess.CompletedProcess[str]], root: Path
) -> None:
    before = {path.name: path.stat().st_mtime_ns for path in island.iterdir()}
    result = paradize("bake", root / "raw_assets/island.toml", "-o", island, "--json")
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert report["baked"] == 0
    assert report["reused"] == len(report["artifacts"]) > 0
    assert {path.name: path.stat().st_mtime_ns for path in island.iterdir()} == before
