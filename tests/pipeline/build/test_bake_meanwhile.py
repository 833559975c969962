"""A file that is edited while a bake runs, appears after it, or decays in the store, never counts as
baked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions, JobObserver
from tests.pipeline.scenes import make_cove, write_image
from tests.pipeline.small_scenes import make_post, without_object
from tests.sweeps import sweep


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))


class Ended(JobObserver):
    def __init__(self, then: Callable[[], object]) -> None:
        self.then = then

    def ended(self, name: str, seconds: float) -> None:
        self.then()


def test_a_scene_edited_during_its_bake_is_baked_again(tmp_path: Path) -> None:
    scene, out = make_cove(tmp_path / "scene"), tmp_path / "out"
    edited = without_object(scene).read_text().replace("max_error_m = 0.05", "max_error_m = 0.5")

    first = bake(scene, out, BuildOptions(observer=Ended(lambda: scene.write_text(edited))))
    assert not first.errors
    again = bake(scene, out, BuildOptions())
    assert [row["name"] for row in again.rows if row["status"] == "baked"] == ["terrain_mesh"]
    assert bake(scene, out).count("reused") == 9


def one_level(scene: Path) -> Path:
    """More levels of the object are measured, which takes longer than all else."""
    scene.write_text(scene.read_text().replace("lods = 3", "lods = 1"))
    return scene


def test_a_source_edited_during_its_bake_spoils_that_artifact_and_not_the_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, out = one_level(make_post(tmp_path / "scene")), tmp_path / "out"
    before = (scene.parent / "wood.png").read_bytes()
    white = np.full((32, 32, 3), 255, np.uint8)
    observer = Ended(lambda: write_image(scene.parent / "wood.png", white))
    report = bake(scene, out, BuildOptions(observer=observer))
    assert report.errors and all("changed while it was baked" in str(error) for error in report.errors)
    assert all("wood.png" in str(error) for error in report.errors) and not (out / "scene.json").exists()
    (scene.parent / "wood.png").write_bytes(before)
    report = bake(scene, out, BuildOptions())
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "another_store"))
    anew = bake(scene, tmp_path / "anew", BuildOptions())
    assert not report.errors and not anew.errors
    assert [row["sha256"] for row in report.rows] == [row["sha256"] for row in anew.rows]


@pytest.mark.parametrize("late", sweep(["post.mtl", "wood.png"], test=["post.mtl"]))
def test_a_material_file_or_its_map_that_appears_later_is_noticed(tmp_path: Path, late: str) -> None:
    scene, out = one_level(make_post(tmp_path / "scene")), tmp_path / "out"
    scene.write_text(scene.read_text().replace('color = "wood.png"\n', ""))
    held = (scene.parent / late).read_bytes()
    (scene.parent / late).unlink()
    first = bake(scene, out, BuildOptions())
    assert not first.errors and "post_color" not in {row["name"] for row in first.rows}
    assert not bake(scene, out, BuildOptions()).count("baked")
    (scene.parent / late).write_bytes(held)
    second = bake(scene, out, BuildOptions())
    assert "post_color" in {row["name"] for row in second.rows}


DECAYED = [b"3", b"[]", b'{"mesh": 3, "color": {"sha256": "x"}}', b"{", b""]


@pytest.mark.deep  # cut products, of every kind: tests/pipeline/store/test_safe.py
@pytest.mark.parametrize("decayed", DECAYED)
def test_products_that_decay_in_the_store_are_baked_again(
    tmp_path: Path, cove_store: Callable[[Path], Path], decayed: bytes
) -> None:
    scene = make_cove(tmp_path / "scene")
    cove_store(tmp_path / "store")
    assert bake(scene, tmp_path / "out", BuildOptions()).count("reused") == 14
    for path in (tmp_path / "store" / "products").glob("*/*"):
        path.write_bytes(decayed)
    again = bake(scene, tmp_path / "anew", BuildOptions())
    assert not again.errors and again.count("baked") == 14


@pytest.mark.deep
def test_a_link_that_leads_elsewhere_is_noticed(tmp_path: Path) -> None:
    scene, out = make_cove(tmp_path / "scene"), tmp_path / "out"
    wood = scene.parent / "wood.png"
    wood.rename(scene.parent / "oak.png")
    wood.symlink_to("oak.png")
    bake(scene, out, BuildOptions())
    assert bake(scene, out, BuildOptions()).count("reused") == 14
    wood.unlink()
    wood.symlink_to("sand.png")
    again = bake(scene, out, BuildOptions())
    assert not again.errors and "post_color" in {
        row["name"] for row in again.rows if row["status"] == "baked"
    }
