"""A scene is baked whole or not at all, once, and only what it requires."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build import publish
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.errors import BakeError, GroupedError
from paradize.formats.scene.manifest import decode_scene
from paradize.jobs import process
from paradize.jobs.process import WorkerPool
from paradize.store.atomic import PARTIAL, unwritten, write_whole
from paradize.store.local import Store
from tests.pipeline import material_scene
from tests.pipeline.bakes import bake_apart
from tests.pipeline.scenes import make_cove, write_image
from tests.pipeline.small_scenes import sky_and_water
from tests.processes import started
from tests.sweeps import sweep

# A square whose second triangle is repeated, without texture coordinates: both are warned of.
BENT = """usemtl wood
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
f 1 2 3
f 1 3 4
f 1 3 4
"""


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))


@pytest.fixture(scope="module")
def baked(
    tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]
) -> tuple[Path, Path, Path]:
    """(scene, out, store) of a finished bake, to be copied by the tests that change it."""
    top = tmp_path_factory.mktemp("cove")
    scene, store = make_cove(top / "scene"), cove_store(top / "store")
    text = scene.read_text()  # more levels of the object are measured, which takes longer than all else
    scene.write_text(text.replace("lods = 3", "lods = 1"))
    bake_apart(scene, top)
    return scene, top / "out", store


@pytest.fixture
def copied(baked: tuple[Path, Path, Path], tmp_path: Path) -> tuple[Path, Path]:
    """(scene, out) in a folder of the test's own, the store warm."""
    scene, out, store = baked
    shutil.copytree(scene.parent, tmp_path / "scene")
    shutil.copytree(out, tmp_path / "out")
    shutil.copytree(store, tmp_path / "store")
    return tmp_path / "scene" / scene.name, tmp_path / "out"


def test_a_bake_ends_the_workers_that_it_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = make_cove(tmp_path / "scene")  # of its sound alone
    text = scene.read_text()
    scene.write_text(text[: text.index("[fog]")] + text[text.index("[sound]") :])
    pools = []

    def pool() -> WorkerPool:
        pools.append(WorkerPool())
        return pools[-1]

    processes = []
    monkeypatch.setattr("paradize.build.bake.WorkerPool", pool)
    start = process.start_worker

    def start_worker(*given: Any) -> process.Worker:
        worker = start(*given)
        processes.append(worker.process)
        return worker

    monkeypatch.setattr("paradize.jobs.pool.start_worker", start_worker)
    assert not bake(scene, tmp_path / "out", BuildOptions()).errors
    assert len(pools) == 1 and processes
    assert all(one.poll() is not None for one in processes)


def manifest_of(out: Path) -> dict[str, Any]:
    return decode_scene((out / "scene.json").read_bytes())


def state_of(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(out.iterdir())}


def baked_names(report: BakeReport) -> set[str]:
    return {row["name"] for row in report.rows if row["status"] == "baked"}


def test_every_pass_gets_what_it_reads_and_the_manifest_names_it(baked: tuple[Path, Path, Path]) -> None:
    _, out, _ = baked
    manifest = manifest_of(out)
    assert set(manifest["artifacts"]) == {
        "sky", "terrain_mesh", "sand_color", "sand_normal", "effect_color", "effect_normal", "water_normal",
        "water_dudv", "post_mesh", "post_color", "post_normal", "post_height", "post_gloss", "sound",
    }  # fmt: skip
    assert {path.name for path in out.iterdir()} == {
        "scene.json", *(artifact["file"] for artifact in manifest["artifacts"].values())
    }  # fmt: skip
    for name, artifact in manifest["artifacts"].items():
        assert artifact["file"].startswith(f"{name}-{artifact['sha256'][:8]}.")
        assert (out / artifact["file"]).stat().st_size == artifact["bytes"]
    assert sorted(manifest["streaming"]) == sorted(manifest["artifacts"])
    assert manifest["streaming"][0] == "sky"
    (item,) = manifest["objects"]
    assert item["materials"]["wood"]["parallax_scale"] == 0.01
    assert item["lods"][0] == {"node": "lod0", "error_m": 0.0}
    assert item["center"] == pytest.approx([0.0, 1.0, 0.0], abs=1e-5)
    assert item["instances"][0]["rotation"] == pytest.approx([0.0, 0.5**0.5, 0.0, 0.5**0.5])
    assert manifest["terrain"]["height_range_m"] == pytest.approx([-2.0, 2.0], abs=0.05)
    assert manifest["flight"]["errors"]["path_miss_m"] == 0.0
    assert manifest["sun"]["direction"][1] > 0.5


def test_a_second_bake_bakes_nothing_and_says_so(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    bake(scene, out, BuildOptions(jobs=1))  # the copies have other paths: planned anew, all from the store
    before = {path.name: path.stat().st_mtime_ns for path in out.iterdir()}
    report = bake(scene, out, BuildOptions(jobs=1))
    assert (report.count("baked"), report.count("reused"), report.count("failed")) == (0, 14, 0)
    assert {path.name: path.stat().st_mtime_ns for path in out.iterdir()} == before


def test_a_moved_or_touched_source_is_a_hit(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    os.utime(scene.parent / "sand.png")
    scene.write_text("# a comment\n" + scene.read_text())
    assert baked_names(bake(scene, out, BuildOptions(jobs=1))) == set()


def test_a_changed_colour_map_bakes_its_own_maps_and_sweeps_the_old(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    old = manifest_of(out)["artifacts"]
    shutil.copy(scene.parent / "sand.png", scene.parent / "wood.png")
    report = bake(scene, out, BuildOptions())
    assert baked_names(report) == {"post_color", "post_normal", "post_height", "post_gloss"}
    new = manifest_of(out)["artifacts"]
    assert new["post_color"]["sha256"] != old["post_color"]["sha256"]
    assert not (out / old["post_color"]["file"]).exists()
    assert new["sky"] == old["sky"]


@pytest.mark.deep  # the next bake by two workers: test_same_bytes.py
def test_the_bytes_do_not_depend_on_the_number_of_workers(copied: tuple[Path, Path], tmp_path: Path) -> None:
    scene, out = copied
    report = bake(scene, tmp_path / "again", BuildOptions(jobs=1, force=True))
    assert report.count("baked") == 14
    assert state_of(tmp_path / "again") == state_of(out)


@pytest.mark.parametrize(
    ("taken_out", "gone"),
    [
        ("[water]\nwaves = \"waves.png\"\n", {"water_normal", "water_dudv"}),
        ("parallax_scale = 0.01\n", {"post_height"}),
        ("specular = 0.2\n", {"post_gloss"}),
        ("sand_strength = 0.5\n", {"sand_normal"}),
        ("effect_color = \"sand.png\"\n", {"effect_color", "effect_normal"}),
        ("[sound]\nfile = \"sea.ogg\"\n", {"sound"}),
    ],
)  # fmt: skip
def test_what_nothing_reads_is_not_baked(copied: tuple[Path, Path], taken_out: str, gone: set[str]) -> None:
    scene, out = copied
    before = set(manifest_of(out)["artifacts"])
    text = scene.read_text()
    assert taken_out in text
    scene.write_text(text.replace(taken_out, ""))
    report = bake(scene, out, BuildOptions())
    assert not report.errors
    assert before - set(manifest_of(out)["artifacts"]) == gone


def test_all_failures_are_told_and_the_old_scene_stays(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    before = state_of(out)
    (scene.parent / "wood.png").write_bytes(b"\x89PNG\r\n\x1a\nbroken")
    (scene.parent / "sea.ogg").write_bytes(b"OggSilence")
    (scene.parent / "post.obj").write_text("v 0 0 0\nf 1 2 3\n")
    report = bake(scene, out, BuildOptions())
    message = "\n".join(str(error) for error in report.errors)
    assert all(name in message for name in ("wood.png", "sea.ogg", "post.obj")), message
    assert {row["name"] for row in report.rows if row["status"] == "failed"} >= {"post_mesh", "sound"}
    assert state_of(out) == before


def test_a_scene_that_names_an_unknown_material_is_refused(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    before = state_of(out)
    scene.write_text(scene.read_text().replace("material.wood", "material.stone"))
    report = bake(scene, out, BuildOptions())
    assert len(report.errors) == 1
    assert "material.stone" in str(report.errors[0]) and "wood" in str(report.errors[0])
    assert state_of(out) == before


def test_meshes_larger_than_the_player_takes_are_refused_with_their_size_and_limit(tmp_path: Path) -> None:
    (tmp_path / "panel.obj").write_text("v 0 0 0\nv 1.5e7 0 0\nv 0 1.5e7 0\nf 1 2 3\n")
    (tmp_path / "far.obj").write_text("v 9e6 0 0\nv 1.1e7 0 0\nv 9e6 1e6 0\nf 1 2 3\n")
    head, tail = material_scene.SCENE.split("[object.material.metal]")
    instance, flight = tail[tail.index("[[object.instance]]") :].split("[flight]")
    far = head[head.index("[[object]]") :].replace("panel", "far")
    scene = tmp_path / "panels.toml"
    scene.write_text(f"{head}{instance}{far}{instance}[flight]{flight}")
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not (tmp_path / "out" / "scene.json").exists()
    first, second = sorted(map(str, report.errors))
    assert "far.obj: a coordinate is 1.1e+07 metres, limit 1e+07" in first
    assert "panel.obj: its radius is 1.06066e+07 metres, limit 1e+07; scale the model down" in second


def test_settings_of_a_material_whose_triangles_were_all_dropped_are_a_warning(tmp_path: Path) -> None:
    triangles = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nusemtl wood\nf 1 2 3\nusemtl line\nf 1 2 4\n"
    (tmp_path / "panel.obj").write_text(triangles)
    scene = tmp_path / "panels.toml"
    head, tail = material_scene.SCENE.split("[object.material.metal]")
    table = "[object.material.line]\ntwo_sided = true\n"
    scene.write_text(head + table + tail[tail.index("[[object.instance]]") :])
    report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
    assert not report.errors
    (warning,) = (text for text in report.warnings if "object[0].material.line" in text)
    assert str(scene) in warning and "no triangle of this material" in warning and "dropped" in warning


def test_an_object_without_a_colour_map_takes_the_one_of_its_materials(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    scene.write_text(scene.read_text().replace('color = "wood.png"\n', ""))
    assert baked_names(bake(scene, out, BuildOptions(jobs=1))) == set()
    (scene.parent / "post.mtl").write_text("newmtl wood\nKd 0.25 0.5 0.75\n")
    bake(scene, out, BuildOptions(jobs=1))
    item = json.loads((out / "scene.json").read_text())["objects"][0]
    wood = item["materials"]["wood"]
    assert set(wood["maps"].values()) == {None}
    assert wood["color"] == [0.25, 0.5, 0.75]


def test_a_missing_source_is_a_scene_error_before_anything_runs(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    before = state_of(out)
    (scene.parent / "waves.png").unlink()
    (scene.parent / "px.exr").unlink()
    with pytest.raises(GroupedError) as caught:
        bake(scene, out)
    assert "waves.png" in str(caught.value) and "px.exr" in str(caught.value)
    assert state_of(out) == before


def test_damaged_outputs_and_store_entries_are_mended(copied: tuple[Path, Path], tmp_path: Path) -> None:
    scene, out = copied
    bake(scene, out, BuildOptions(jobs=1))
    before = state_of(out)
    sky = next(path for path in out.iterdir() if path.name.startswith("sky-"))
    sky.write_bytes(b"x" * sky.stat().st_size)
    next(path for path in out.iterdir() if path.name.startswith("post_color-")).unlink()
    assert baked_names(bake(scene, out, BuildOptions(jobs=1))) == set()
    assert state_of(out) == before
    for blob in (tmp_path / "store/blobs").rglob("*"):
        if blob.is_file() and blob.stat().st_size:
            data = bytearray(blob.read_bytes())
            data[len(data) // 2] ^= 1
            blob.write_bytes(data)
    shutil.rmtree(out)
    assert len(baked_names(bake(scene, out, BuildOptions()))) == 14
    assert state_of(out) == before


def test_one_damaged_store_entry_bakes_its_own_task_again(copied: tuple[Path, Path], tmp_path: Path) -> None:
    """Also where the task's other products are whole."""
    scene, out = copied
    bake(scene, out, BuildOptions(jobs=1))
    before = state_of(out)
    for name in ("post_height", "post_normal", "water_dudv"):
        sha256 = manifest_of(out)["artifacts"][name]["sha256"]
        blob = tmp_path / "store" / "blobs" / sha256[:2] / sha256
        blob.write_bytes(blob.read_bytes()[:-1])
        shutil.rmtree(out)
        report = bake(scene, out, BuildOptions(jobs=1))
        assert not report.errors and name in baked_names(report) and "sky" not in baked_names(report)
        assert state_of(out) == before


def test_files_of_others_are_never_swept(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    for name in ("notes.txt", "palm.glb", "sky-old.ktx2"):
        (out / name).write_text("mine")
    (out / "sky-00000000.ktx2").write_text("an old bake's")
    bake(scene, out, BuildOptions(jobs=1))
    names = {path.name for path in out.iterdir()}
    assert {"notes.txt", "palm.glb", "sky-old.ktx2"} <= names and "sky-00000000.ktx2" not in names


def test_what_a_killed_bake_left_is_swept_also_where_nothing_changed(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    bake(scene, out, BuildOptions(jobs=1))
    before = state_of(out)
    (out / f".sky-01234567.ktx2{PARTIAL}89ab").write_text("half")
    (out / "sky-01234567.ktx2").write_text("never named")
    assert bake(scene, out, BuildOptions(jobs=1)).count("reused") == 14
    assert state_of(out) == before


def test_a_budget_that_is_exceeded_is_told(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    scene.write_text(scene.read_text() + "[budget]\nterrain_max_m = 0.0001\ncolor_psnr_db = 1.0\n")
    report = bake(scene, out, BuildOptions(jobs=1))
    rows = {row["name"]: row for row in report.rows}
    assert "terrain_max_m" in rows["terrain_mesh"]["over"][0] and not rows["sand_color"]["over"]
    assert any("terrain_max_m" in warning for warning in report.warnings)
    assert manifest_of(out)["budget"]["hard"] == {"terrain_max_m": 0.0001, "color_psnr_db": 1.0}


def test_what_another_scene_baked_warns_of_this_scenes_own_files(
    tmp_path: Path, cove_store: Callable[[Path], Path]
) -> None:
    cove_store(tmp_path / "store")
    result = []
    for name in ("first", "second"):
        scene = make_cove(tmp_path / name)
        for face in ("px", "nx", "py", "ny", "pz", "nz"):
            write_image(scene.parent / f"{face}.png", np.full((8, 8, 3), 90, np.uint8))
        (scene.parent / "post.obj").write_text("mtllib post.mtl\n" + BENT)
        scene.write_text(scene.read_text().replace(".exr", ".png"))
        report = bake(scene, tmp_path / f"{name}.out", BuildOptions(jobs=1))
        assert not report.errors
        result.append(report.warnings)
    again = [row["name"] for row in report.rows if row["status"] == "baked"]
    assert again == []
    assert any("px.png: 8 bits" in text for text in result[0]) and any(
        "post.obj" in text for text in result[0]
    )
    assert result[1] == [text.replace(f"{tmp_path}/first/", f"{tmp_path}/second/") for text in result[0]]


def test_a_folder_that_cannot_be_written_is_one_error(copied: tuple[Path, Path], tmp_path: Path) -> None:
    scene, _ = copied
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(BakeError, match="file/out: cannot be written: Not a directory"):
        bake(scene, tmp_path / "file" / "out", BuildOptions(jobs=1))


def test_a_disk_that_is_full_keeps_no_artifact_that_no_scene_names(
    copied: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, out = copied
    (tmp_path / "new").mkdir()
    for place in (out, tmp_path / "new"):
        for artifact in out.glob("sky-*"):
            artifact.write_bytes(b"damaged")  # written anew where it stands: the old scene names it
        before = sorted(path.name for path in place.iterdir())

        def full(path: Path, data: Any, **settings: Any) -> None:
            if path.name == "scene.json":
                raise unwritten(path, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
            write_whole(path, data, **settings)

        with monkeypatch.context() as disk:
            disk.setattr(publish, "write_whole", full)
            disk.setattr(publish, "_has_bytes", lambda *_: False)
            report = bake(scene, place, BuildOptions(jobs=1))
        assert [str(error).partition(": ")[2] for error in report.errors] == [
            "cannot be written: No space left on device; free space there, or name another place"
        ]
        assert sorted(path.name for path in place.iterdir()) == before


def test_a_scene_that_is_written_and_not_flushed_keeps_the_artifacts_that_it_names(
    copied: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unflushed(path: Path, data: Any, **settings: Any) -> None:
        write_whole(path, data, **settings)
        if path.name == "scene.json":
            raise unwritten(path, OSError(errno.EIO, os.strerror(errno.EIO)))

    monkeypatch.setattr(publish, "write_whole", unflushed)
    report = bake(copied[0], tmp_path / "new", BuildOptions(jobs=1))
    assert len(report.errors) == 1
    manifest = json.loads((tmp_path / "new" / "scene.json").read_text())
    assert all((tmp_path / "new" / entry["file"]).exists() for entry in manifest["artifacts"].values())


def test_a_bake_whose_record_cannot_be_written_is_done_and_warns(
    copied: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(store: Store, name: str, *_: Any) -> None:
        raise unwritten(store.root / name, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))

    monkeypatch.setattr(Store, "put_bake", full)
    report = bake(copied[0], tmp_path / "new", BuildOptions(jobs=1))
    assert not report.errors and (tmp_path / "new" / "scene.json").exists()
    assert sum("no record of this bake: " in text for text in report.warnings) == 1


def test_sources_with_odd_names_bake(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    shutil.copy(scene.parent / "wood.png", scene.parent / "wöod & plank's.png")
    scene.write_text(scene.read_text().replace('color = "wood.png"', 'color = "wöod & plank\'s.png"'))
    assert not bake(scene, out, BuildOptions(jobs=1)).errors


def test_the_report_is_json(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    tree = json.loads(json.dumps(bake(scene, out, BuildOptions(jobs=1)).as_json(), allow_nan=False))
    assert {"artifacts", "baked", "reused", "failed", "seconds", "warnings"} <= tree.keys()
    keys = {"name", "file", "sha256", "bytes", "tier", "errors", "status"}
    assert all(keys <= row.keys() for row in tree["artifacts"])


def test_a_one_pixel_step_of_the_heightmap_changes_the_terrain_alone(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    import numpy as np

    write_image(scene.parent / "height.png", np.zeros((5, 5, 1), np.uint16))
    assert baked_names(bake(scene, out, BuildOptions(jobs=1))) == {"terrain_mesh"}


def test_effects_on_an_oblong_terrain_rise_as_steeply_both_ways(copied: tuple[Path, Path]) -> None:
    """The same map over 20 x 20 m and 20 x 10 m: along z its slopes double, along x they stay."""
    import numpy as np

    from paradize.formats.ktx2.reader import decode_ktx2
    from paradize.metrics.texels import decode_texels

    scene, out = copied
    z, x = np.mgrid[0:32, 0:32] / 32.0
    bumps = 0.5 + 0.1 * np.sin(2.0 * np.pi * x) + 0.1 * np.sin(2.0 * np.pi * z)
    write_image(scene.parent / "bumps.png", (bumps * 65535).astype(np.uint16)[:, :, None])
    text = scene.read_text().replace('effect_color = "sand.png"', 'effect_height = "bumps.png"')
    slopes = []
    for size in ("[20.0, 20.0]", "[20.0, 10.0]"):
        scene.write_text(text.replace("[20.0, 20.0]", size))
        assert not bake(scene, out, BuildOptions(jobs=1)).errors
        file = manifest_of(out)["artifacts"]["effect_normal"]["file"]
        normals = decode_texels(decode_ktx2((out / file).read_bytes())).astype(np.float64)[4:-4, 4:-4]
        up = np.sqrt(1.0 - normals[:, :, 0] ** 2 - normals[:, :, 1] ** 2)
        slopes.append([float(np.abs(normals[:, :, k] / up).max()) for k in range(2)])
    assert slopes[1][0] == pytest.approx(slopes[0][0], rel=0.3)
    assert slopes[1][1] == pytest.approx(2.0 * slopes[0][1], rel=0.3)


@pytest.mark.parametrize("delay_s", sweep([0.05, 0.2, 0.35, 0.5, 0.7, 0.9], test=[0.5]))
def test_a_kill_at_any_moment_leaves_the_old_or_the_new_scene(
    copied: tuple[Path, Path], tmp_path: Path, delay_s: float
) -> None:
    """SIGKILL while everything is baked anew over an older bake; the next bake mends what is left."""
    scene, out = copied
    new = state_of(out)
    sand = (scene.parent / "sand.png").read_bytes()
    shutil.copy(scene.parent / "wood.png", scene.parent / "sand.png")
    assert not bake(scene, out, BuildOptions()).errors
    old = state_of(out)
    assert old != new
    (scene.parent / "sand.png").write_bytes(sand)
    command = [
        sys.executable,
        "-m",
        "paradize.cli.main",
        "bake",
        str(scene),
        "-o",
        str(out),
        "--force",
        "-j",
        "2",
    ]
    with started(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            process.wait(timeout=delay_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    left = state_of(out)
    for state in (old, new):
        if left["scene.json"] == state["scene.json"]:
            assert all(left[name] == data for name, data in state.items())
            break
    else:
        raise AssertionError("scene.json is neither the old nor the new one")
    assert not bake(scene, out, BuildOptions()).errors
    assert state_of(out) == new


def test_two_bakes_at_once_both_succeed(copied: tuple[Path, Path], tmp_path: Path) -> None:
    """Of sky, water and sound alone: the object's levels are measured for seconds."""
    scene, out = copied
    sky_and_water(scene.parent)
    assert not bake(scene, out, BuildOptions()).errors
    command = [
        sys.executable,
        "-m",
        "paradize.cli.main",
        "bake",
        str(scene),
        "-o",
        str(tmp_path / "both"),
        "--force",
    ]
    one = [*command, "-j", "1"]
    with started(one, stdout=subprocess.DEVNULL) as a, started(one, stdout=subprocess.DEVNULL) as b:
        assert [process.wait(timeout=300) for process in (a, b)] == [0, 0]
    assert state_of(tmp_path / "both") == state_of(out)


def test_a_textured_model_without_uvs_gets_a_layout_and_the_bake_says_so(copied: tuple[Path, Path]) -> None:
    scene, out = copied
    post = scene.parent / "post.obj"
    bare = [line for line in post.read_text().splitlines() if not line.startswith("vt ")]
    post.write_text("\n".join(re.sub(r"(\d+)/\d+", r"\1/", line) for line in bare) + "\n")
    report = bake(scene, out, BuildOptions(jobs=1))
    assert not report.errors
    assert any("UV layout was made" in warning for warning in report.warnings)
    glb = next(out.glob("post_mesh-*.glb"))
    assert b"TEXCOORD_0" in glb.read_bytes() and b"TANGENT" in glb.read_bytes()
