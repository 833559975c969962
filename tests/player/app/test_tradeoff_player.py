"""The player's quality features in tradeoff.json."""

from __future__ import annotations

from pathlib import Path

import pytest

from paradize.errors import BakeError
from paradize.tiers import TIERS
from paradize.tradeoff.player import _Player, player_groups
from tests.places import ROOT
from tests.player.synthetic import write_scene

PLAYER = ROOT / "build/bin/paradize-player"
FEATURES = ["shadow", "reflection", "refraction", "lod", "resolution"]


@pytest.mark.deep
@pytest.mark.parametrize("features", [FEATURES, FEATURES[:1]])
def test_every_quality_feature_is_timed_and_compared_with_the_reference(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, features: list[str]
) -> None:
    """The features are those that the player names; some devices have anisotropy."""
    folder = write_scene(tmp_path / "scene")
    names = _Player.features

    def some(player: _Player, folder: Path) -> list[str]:
        assert [name for name in names(player, folder) if name != "anisotropy"] == FEATURES
        return features

    monkeypatch.setattr(_Player, "features", some)
    result: list[str] = []
    groups = list(
        player_groups(
            PLAYER,
            folder,
            variants={"fast": folder},
            seconds=[1.0],
            size=(96, 54),
            frames=2,
            samples=4,
            on_progress=lambda what, done, of: result.append(f"{done}/{of} {what}"),
        )
    )
    assert [group["name"] for group in groups] == [*features, "texture format"]
    for group in groups:
        tiers = [point["tier"] for point in group["points"]]
        assert tiers == (["fast", "balanced"] if group["name"] == "texture format" else list(TIERS))
        assert [point["tier"] for point in group["points"] if point["in_use"]] == ["balanced"]
        for point in group["points"]:
            assert 0.0 < point["seconds"]["low"] <= point["seconds"]["median"] <= point["seconds"]["high"]
            assert point["seconds"]["runs"] == 2
            assert 0.0 < point["error"]["mean"] <= point["error"]["p99"] <= point["error"]["max"] <= 1.0
            assert point["error"]["value"] == point["error"]["mean"]
    # The same folder under another name gives the same picture.
    same = groups[-1]["points"]
    assert same[0]["error"] == same[1]["error"]
    assert same[0]["bytes"] == same[1]["bytes"] > 0
    shadow = {point["tier"]: point["error"]["mean"] for point in groups[0]["points"]}
    assert len(set(shadow.values())) == 3
    assert len(result) == 1 + int(result[0].partition("/")[2].split()[0])


def test_a_player_that_fails_is_reported_with_its_own_message(tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene")
    (folder / "sky.ktx2").unlink()
    with pytest.raises(BakeError, match=r"sky\.ktx2"):
        next(player_groups(PLAYER, folder, seconds=[1.0], size=(64, 36), samples=1))
