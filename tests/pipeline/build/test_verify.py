"""`bake --verify` finds artifacts that their sources do not give."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from paradize.build.verify import sample
from paradize.cli import main as cli
from paradize.store.local import seal, unseal
from tests.pipeline.small_scenes import sky_and_water


def test_the_sample_is_always_the_same_and_never_empty() -> None:
    names = [f"a{i}" for i in range(40)]
    assert sample(names, 10.0) == sample(names[::-1], 10.0) and len(sample(names, 10.0)) == 4
    assert len(sample(names, 10.1)) == 5 and len(sample(names[:7], 99.0)) == 7  # that share or more
    assert len(sample(names, 0.1)) == 1 and sample(names, 100.0) == sorted(names) and sample([], 50.0) == []
    assert set(sample(names, 10.0)) < set(sample(names, 50.0))


def test_an_artifact_that_its_sources_do_not_give_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A poisoned store: the sky's key leads to other bytes, whose hash and seal are right."""
    store, out = tmp_path / "store", tmp_path / "out"
    monkeypatch.setenv("PARADIZE_STORE", str(store))
    scene = sky_and_water(tmp_path / "scene")
    words = ["bake", str(scene), "-o", str(out), "--json", "-j", "1"]
    assert cli.main(words) == 0
    capfd.readouterr()
    products = [path for path in store.glob("products/*/*") if path.is_file()]
    trees: dict[Path, Any] = {path: unseal(path.read_bytes()) for path in products}
    (water,) = (tree["dudv"] for tree in trees.values() if "dudv" in tree)
    (sky,) = (path for path, tree in trees.items() if "sha256" in tree.get("sky", ()))
    trees[sky]["sky"]["sha256"] = water["sha256"]
    sky.write_bytes(seal(trees[sky]))
    shutil.rmtree(store / "bakes")
    assert cli.main([*words, "--verify", "100"]) == 1
    report = json.loads(capfd.readouterr().out)
    assert len(report["error"]) == 1 and "sky: is not what its sources give" in report["error"][0]
    (advised,) = re.findall(r"; bake with (--force)$", report["error"][0])
    assert cli.main([*words, advised]) == 0
    capfd.readouterr()
    assert cli.main([*words, "--verify", "100"]) == 0
    assert len(json.loads(capfd.readouterr().out)["verified"]) == 4


@pytest.mark.parametrize("share", ["0", "101", "-1", "much"])
def test_a_share_that_is_none_is_wrong_usage(share: str) -> None:
    assert cli.main(["bake", "a.toml", "--verify", share]) == 2
