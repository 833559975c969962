"""`check` finds the faults of a scene's TOML without baking, and the hooks of pre-commit run it."""

from __future__ import annotations

import importlib
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from paradize.checks import check_paths
from paradize.cli import main as cli
from tests.pipeline.scenes import make_cove
from tests.places import ROOT
from tests.sweeps import sweep

HOOKS: list[dict[str, Any]] = importlib.import_module("yaml").safe_load(
    (ROOT / ".pre-commit-hooks.yaml").read_text()
)


@pytest.fixture
def cove(tmp_path: Path) -> Path:
    """A scene with the name that `paradize new` gives."""
    return make_cove(tmp_path).rename(tmp_path / "scene.toml")


def edit(scene: Path, old: str, new: str) -> None:
    text = scene.read_text()
    assert old in text
    scene.write_text(text.replace(old, new))


def test_a_sound_scene_has_no_finding_and_bakes_nothing(cove: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(cove.parent)
    monkeypatch.setenv("PARADIZE_STORE", str(cove.parent / "store"))
    before = sorted(cove.parent.rglob("*"))
    assert check_paths([cove]) == []
    assert sorted(cove.parent.rglob("*")) == before


def test_every_fault_of_a_scene_is_a_finding_with_its_place_and_mend(cove: Path) -> None:
    edit(cove, "[flight]", "[flight]\nspede = 1\nduratoin_s = 2")
    edit(cove, 'color = "wood.png"', 'color = "woods.png"')
    found = check_paths([cove])
    assert {finding.code for finding in found} == {"PZ431"}
    assert {"flight.spede", "flight.duratoin_s", "object[0].color"} <= {finding.place for finding in found}
    assert all(finding.fails and finding.mend and finding.file == str(cove) for finding in found)


def test_a_code_that_names_no_rule_is_told_before_a_bake(cove: Path) -> None:
    waiver = '[[waiver]]\nrule = "PZ998"\nreason = "June"\nuntil = 2026-06-30\n'
    cove.write_text(f'{cove.read_text()}\n[check]\nPZ999 = "off"\nPZ232 = "off"\n{waiver}')
    found = check_paths([cove])
    assert [(one.code, one.place) for one in found] == [("PZ407", "waiver[0]"), ("PZ407", "check.PZ999")]
    assert not any(one.fails for one in found)
    text = cove.read_text()
    for severity, fails in (("error", [True, True]), ("off", [])):
        cove.write_text(text.replace("[check]\n", f'[check]\nPZ407 = "{severity}"\n'))
        assert [one.fails for one in check_paths([cove])] == fails


def test_equal_faults_at_several_places_are_all_listed(cove: Path) -> None:
    edit(cove, "[flight]", "[flight]\nspede = 1\nspude = 2")
    assert len({finding.place for finding in check_paths([cove])}) == 2


def test_check_says_what_it_looked_at_and_that_no_model_was_read(
    cove: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["check", str(cove)]) == 0
    first, last = capsys.readouterr().out.splitlines()
    assert re.search(
        r"scene.toml: .* the files that it names \(\d+\) are there; `paradize bake` reads", first
    )
    assert last == "the settings of 1 scene checked: no finding"
    edit(cove, "[flight]", "[flight]\nspede = 1")
    assert cli.main(["check", str(cove)]) == 1
    assert "are there" not in (output := capsys.readouterr().out)
    assert output.endswith("the settings of 1 scene checked: 1 error, 0 warnings\n")


@pytest.mark.parametrize("mode", ["opaque", "blend"])
def test_a_cutoff_beside_a_mode_without_one_is_refused(cove: Path, mode: str) -> None:
    scene = cove.read_text()
    table = f'[object.material.leaf]\nalpha_mode = "{mode}"\nalpha_cutoff = 0.5\n\n[[object.instance]]'
    cove.write_text(scene.replace("[[object.instance]]", table, 1))
    places = {finding.place: finding for finding in check_paths([cove])}
    assert "has no cutoff" in places["object[0].material.leaf.alpha_cutoff"].what


@pytest.mark.parametrize("text", ["", "[scene", "\ufeff[scene]\n", "scene = 1\n", "\x00"])
def test_a_toml_that_is_no_scene_is_one_or_more_findings_and_no_crash(tmp_path: Path, text: str) -> None:
    (tmp_path / "scene.toml").write_text(text)
    found = check_paths([tmp_path / "scene.toml"])
    assert found and {finding.code for finding in found} == {"PZ431"}


def test_hooks_have_the_keys_that_pre_commit_asks_for() -> None:
    assert [hook["id"] for hook in HOOKS] == ["paradize-scene", "paradize-check"]
    for hook in HOOKS:
        assert {"id", "name", "entry", "language"} <= hook.keys()
        assert hook["language"] == "python", "pre-commit installs this repository"
    readme = (ROOT / "pipeline/paradize/checks/README.md").read_text()
    assert set(re.findall(r"- id: ([\w-]+)", readme)) == {hook["id"] for hook in HOOKS}


@pytest.mark.parametrize("hook", sweep(HOOKS, test=HOOKS[:1]), ids=[hook["id"] for hook in HOOKS])
def test_a_hook_passes_sound_files_and_fails_on_faults(hook: dict[str, Any], cove: Path) -> None:
    """As pre-commit calls it: the entry, then the files whose names match."""
    (cove.parent / "Cargo.toml").write_text("[package]\n")
    names = sorted(str(path.relative_to(cove.parent)) for path in cove.parent.rglob("*") if path.is_file())
    taken = [name for name in names if re.search(hook["files"], name)]
    assert taken == ["scene.toml"]
    command = [
        str(Path(sys.executable).parent / shlex.split(hook["entry"])[0]),
        *shlex.split(hook["entry"])[1:],
    ]
    assert subprocess.run([*command, *taken], cwd=cove.parent, capture_output=True).returncode == 0
    edit(cove, "[flight]", "[flight]\nspede = 1")
    result = subprocess.run([*command, *taken], cwd=cove.parent, capture_output=True, text=True)
    assert result.returncode == 1 and "scene.toml: flight.spede: error PZ431" in result.stdout
