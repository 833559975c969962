"""The command line keeps its contract: exit codes, one JSON object, one message, nothing half."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.cli.main import main, parser
from paradize.cli.table import errors_text, head_of
from tests.pipeline.cli.test_wrong_inputs import run as called
from tests.pipeline.scenes import make_cove, write_image
from tests.processes import started
from tests.sweeps import sweep

Run = Callable[..., "subprocess.CompletedProcess[str]"]
MAPS = ("normal", "height", "gloss", "dudv")


@pytest.fixture(scope="module")
def cove(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With one level of its object: more are measured, which takes longer than all else."""
    scene = make_cove(tmp_path_factory.mktemp("cove"))
    scene.write_text(scene.read_text().replace("lods = 3", "lods = 1"))
    return scene


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(tmp_path_factory.mktemp("store"))


@pytest.fixture
def run(store: str, paradize: Run) -> Run:
    """`paradize` in a process of its own."""

    def call(*arguments: object, **kwargs: Any) -> subprocess.CompletedProcess[str]:
        result = paradize(*arguments, env={**os.environ, "PARADIZE_STORE": store}, timeout=300, **kwargs)
        assert "Traceback" not in result.stderr, result.stderr
        return result

    return call


@pytest.fixture
def run_here(store: str, paradize_here: Run, monkeypatch: pytest.MonkeyPatch) -> Run:
    """The same in this process."""
    monkeypatch.setenv("PARADIZE_STORE", store)

    def call(*arguments: object) -> subprocess.CompletedProcess[str]:
        result = paradize_here(*arguments)
        assert "Traceback" not in result.stderr, result.stderr
        return result

    return call


@pytest.mark.parametrize("columns", ["40", "100"])
def test_the_help_of_bake_names_a_page_that_is_there(
    columns: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one piece, at any width, wherever the package is installed."""
    monkeypatch.setenv("COLUMNS", columns)
    with pytest.raises(SystemExit):
        parser("bake").parse_args(["bake", "--help"])
    page = Path(capsys.readouterr().out.split()[-1])
    assert page.name == "FIELDS.md" and page.is_file()


def test_help_and_version_load_modules_of_python_and_of_paradize_alone() -> None:
    """So they are there at once: numpy alone takes longer than all of these."""
    script = """
import sys
from contextlib import suppress
before = set(sys.modules)
from paradize.cli.main import main
for option in ("--version", "--help"):
    with suppress(SystemExit):
        main([option])
loaded = {name.partition(".")[0] for name in set(sys.modules) - before}
print(sorted(loaded - sys.stdlib_module_names - {"__mp_main__"}))
"""
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert output.startswith("paradize ") and output.endswith("\n['paradize']\n")
    assert all(command in output for command in ("bake", "mesh", "maps", "terrain", "check"))


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["paint"],
        ["bake"],
        ["mesh", "a.obj"],
        ["mesh", "a.obj", "-o", "a.glb", "--lods", "0"],
        ["mesh", "a.obj", "-o", "a.glb", "--lods", "99"],
        ["mesh", "a.obj", "-o", "a.glb", "--max-error", "nan"],
        ["maps", "a.png", "-o", "d", "--only", "normal,colour"],
        ["maps", "a.png", "-o", "d", "--wrap", "mirror"],
        ["terrain", "a.png", "-o", "a.glb", "--height", "3"],
        ["terrain", "a.png", "-o", "a.glb", "--height", "3", "--size", "1", "-5"],
        ["bake", "a.toml", "-j", "0"],
        ["bake", "a.toml", "--tier", "best"],
        ["check"],
    ],
)
def test_wrong_usage_exits_2(words: list[str]) -> None:
    code, out, errors = called(*words)
    assert code == 2 and out == "" and errors


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("mesh a.obj -o a.glb --budgt surface_max=1", "did you mean --budget?"),
        ("mesh a.obj -o a.glb --lod=2", "did you mean --lods?"),
        ("mehs a.obj", "did you mean mesh?"),
        (
            "terrain a.png -o a.glb --size 1000",
            "width and depth in metres, first to last pixel: --size X Z",
        ),
        ("mesh a.obj -o a.glb --lods", "give number of levels of detail, the source included (4): --lods N"),
        (
            "terrain a.png -o a.glb --size 1 1 --budget terrain_mx_m=1",
            "did you mean terrain_max_m? ",
        ),
        ("mesh a.obj -o a.glb --budget surface_max", "surface_max has no limit; write surface_max=LIMIT"),
        (
            "mesh a.obj -o a.glb --budget nothing=1",
            "is no metric of a budget; `paradize mesh` measures surface_max,",
        ),
    ],
)
def test_wrong_usage_is_told_in_one_line_with_what_to_write(words: str, said: str) -> None:
    error, hint = called(*words.split())[2].splitlines()
    command = words.split()[0]
    assert said in error and "error: " in error
    assert hint.startswith(f"`paradize {command} --help`" if command != "mehs" else "`paradize --help`")
    assert "sky_" not in error and "lod_mapped" not in error


@pytest.mark.parametrize("words", [["mesh", "a.obj", "-o", ""], ["bake", "", "-o", "out"], ["check", ""]])
def test_an_empty_name_is_wrong_usage_and_not_the_current_folder(words: list[str]) -> None:
    code, _, said = called(*words)
    assert code == 2 and "is empty; write a name, or . for the current folder" in said


GONE = [
    ["bake", "gone.toml"],
    ["mesh", "gone.obj", "-o", "out.glb"],
    ["maps", "gone.png", "-o", "out"],
    ["terrain", "gone.png", "-o", "out.glb", "--size", "1", "1", "--height", "1"],
    ["maps", ".", "-o", "out"],
    ["mesh", ".", "-o", "out.glb"],
]


@pytest.mark.parametrize(
    "words",
    sweep(GONE, test=[words for words in GONE if words[0] in ("bake", "terrain")]),
)
def test_a_refused_input_exits_1_with_one_message_and_one_object(
    run: Run, tmp_path: Path, words: list[str]
) -> None:
    result = run(*words, "--json", cwd=tmp_path)
    assert result.returncode == 1
    report = json.loads(result.stdout)
    assert len(report["error"]) == 1 and words[1] in report["error"][0]
    assert result.stderr.count("paradize: error:") == 1 and words[1] in result.stderr
    assert not list(tmp_path.iterdir()) or {p.name for p in tmp_path.iterdir()} <= {"build"}


def test_bake_tells_a_table_and_an_object_and_its_second_run_bakes_nothing(
    run_here: Run, cove: Path, tmp_path: Path
) -> None:
    out = tmp_path / "deep" / "out"
    first = run_here("bake", cove, "-o", out, "--json")
    assert first.returncode == 0, first.stderr
    report = json.loads(first.stdout)
    assert (report["baked"], report["reused"], report["failed"]) == (14, 0, 0)
    assert {row["file"] for row in report["artifacts"]} | {"scene.json"} == {p.name for p in out.iterdir()}
    assert "terrain_max_m" in first.stderr and "%|" not in first.stderr  # a table, and no progress bar
    second = json.loads(run_here("bake", cove, "-o", out, "--json").stdout)
    assert (second["baked"], second["reused"], second["failed"]) == (0, 14, 0)
    assert [row["sha256"] for row in second["artifacts"]] == [row["sha256"] for row in report["artifacts"]]
    text = run_here("bake", cove, "-o", out)
    assert "nothing to bake" in text.stdout and "sky" in text.stdout
    forced = json.loads(run_here("bake", cove, "-o", out, "--force", "--json").stdout)
    assert forced["baked"] == 14
    *_, last = run_here("check", out).stdout.splitlines()
    assert last == "14 artifacts checked: no finding"


def test_the_default_folder_is_named_by_the_scene(
    run_here: Run, cove: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_here("bake", cove).returncode == 0
    assert (tmp_path / "build/assets/cove/scene.json").is_file()


def test_a_failed_bake_tells_everything_and_exits_1(run_here: Run, tmp_path: Path) -> None:
    scene = make_cove(tmp_path / "scene")
    (tmp_path / "scene/wood.png").write_bytes(b"no picture")
    (tmp_path / "scene/post.obj").write_text("nothing here")
    result = run_here("bake", scene, "-o", tmp_path / "out", "--json")
    assert result.returncode == 1
    report = json.loads(result.stdout)
    assert report["failed"] >= 2 and report["baked"] + report["reused"] >= 8
    assert any("wood.png" in text for text in report["error"])
    assert any("post.obj" in text for text in report["error"])
    assert not (tmp_path / "out/scene.json").exists()
    failed = {row["name"] for row in report["artifacts"] if row["status"] == "failed"}
    assert {"post_mesh", "post_color"} <= failed


def test_mesh_tells_its_levels(run_here: Run, cove: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "post.glb"
    result = run_here("mesh", cove.parent / "post.obj", "-o", out, "--lods", 3, "-j", 1, "--json")
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert {"triangles", "vertices", "lods", "seconds", "warnings"} <= report.keys()
    finest = report["lods"][0]  # off by what float32 cost alone
    assert finest["triangles"] == report["triangles"] and finest["error_max"] == finest["load_max"] < 1e-6
    assert 1 <= len(report["lods"]) <= 3 and out.read_bytes()[:4] == b"glTF"
    assert run_here("check", out).returncode == 0


def test_maps_of_what_is_surely_a_normal_map_are_told_to_be_wrong(run_here: Run, tmp_path: Path) -> None:
    slopes = 0.2 * np.random.default_rng(3).standard_normal((64, 64, 2))
    normals = np.dstack([slopes, np.ones((64, 64))])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    write_image(tmp_path / "bumps.png", np.round(255 * (0.5 + 0.5 * normals)).astype(np.uint8))
    sky = np.full((64, 64, 3), (128, 128, 215), np.uint8)  # as blue, and of no unit length
    write_image(tmp_path / "sky.png", sky)
    for name, said in (("bumps", True), ("sky", False)):
        result = run_here("maps", tmp_path / f"{name}.png", "-o", tmp_path / name, "--only", "height")
        assert result.returncode == 0 and ("looks like a normal map" in result.stderr) == said, result.stderr


def test_a_table_tells_errors_and_only_with_a_budget_holds_them_against_one() -> None:
    errors = {"surface_max": 0.0125, "surface_rms": 0.003, "lod_normal_p99_deg": 75.0}
    assert errors_text(errors, {}) == "surface_max 0.0125 of the diagonal, lod_normal_p99_deg 75"
    assert errors_text(errors, {"surface_rms": 0.01}) == "surface_rms 0.003 / 0.01 of the diagonal"
    assert "error" in head_of({}) and "error against budget" in head_of({"surface_max": 1.0})


def test_every_environment_variable_that_is_read_stands_in_the_readme(root: Path) -> None:
    files = [*(root / "pipeline").rglob("*.py"), *(root / "player").rglob("*.cpp")]
    read = {name for file in files for name in re.findall(r'"(PARADIZE_[A-Z_]+)"', file.read_text())}
    rows = re.findall(
        r"^\| `(PARADIZE_[A-Z_]+)`", (root / "pipeline/paradize/cli/README.md").read_text(), re.M
    )
    assert sorted(read) == sorted(rows)


@pytest.mark.parametrize("form", sweep(["ktx2", "png"], test=["ktx2"]))
def test_maps_are_named_by_their_source(run_here: Run, cove: Path, tmp_path: Path, form: str) -> None:
    result = run_here("maps", cove.parent / "wood.png", "-o", tmp_path / "m", "--format", form, "--json")
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert set(report["maps"]) == set(MAPS)
    for name, row in report["maps"].items():
        assert row["file"] == f"wood_{name}.{form}" and (tmp_path / "m" / row["file"]).is_file()
        assert {"width", "height", "format", "error", "metric"} <= row.keys()
    only = run_here("maps", cove.parent / "wood.png", "-o", tmp_path / "n", "--only", "dudv,normal", "--json")
    assert set(json.loads(only.stdout)["maps"]) == {"normal", "dudv"}
    assert len(list((tmp_path / "n").iterdir())) == 2


def test_an_output_never_overwrites_its_input(run_here: Run, cove: Path) -> None:
    source = cove.parent / "post.obj"
    before = source.read_bytes()
    result = run_here("mesh", source, "-o", source)
    assert result.returncode == 1 and "input itself" in result.stderr and source.read_bytes() == before
    (cove.parent / "maps").mkdir()
    picture, link = cove.parent / "wood.png", cove.parent / "maps" / "wood_normal.png"
    link.symlink_to(picture)
    before = picture.read_bytes()
    result = run_here("maps", picture, "-o", link.parent, "--only", "normal", "--format", "png")
    assert result.returncode == 1 and "input itself" in result.stderr and picture.read_bytes() == before


def test_through_a_link_the_folder_that_it_leads_to_is_asked_whether_a_file_can_be_written(
    run_here: Run, cove: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    link, closed = tmp_path / "links" / "post.glb", {tmp_path / "links"}
    link.parent.mkdir()
    link.symlink_to(tmp_path / "post.glb")
    monkeypatch.setattr(os, "access", lambda path, mode: path not in closed)
    assert run_here("mesh", cove.parent / "post.obj", "-o", link).returncode == 0
    closed.add(tmp_path)
    result = run_here("mesh", cove.parent / "post.obj", "-o", link)
    assert result.returncode == 1 and f"{tmp_path} is not yours to write" in result.stderr


@pytest.mark.parametrize("place", ["file", "file/folder"])
def test_an_output_place_that_cannot_be_is_told_before_anything_is_baked(
    cove: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    place: str,
) -> None:
    monkeypatch.setattr("paradize.jobs.pool.run_jobs", lambda *_, **__: pytest.fail("was baked"))
    (tmp_path / "file").write_text("in the way")
    for words in (
        ["mesh", cove.parent / "post.obj", "-o", tmp_path / place / "a.glb"],
        ["maps", cove.parent / "wood.png", "-o", tmp_path / place],
        ["maps", cove.parent / "wood.png", "-o", tmp_path / "maps", "--report", tmp_path / place],
        ["measure", cove.parent / "wood.png", "-o", tmp_path / place],
        ["export", cove, "-o", tmp_path / place / "a.glb"],
        ["bake", cove, "-o", tmp_path / place],
    ):
        assert main([str(word) for word in words]) == 1
        message = capsys.readouterr().err
        assert "cannot be written: Not a directory; a file stands where a folder is needed" in message


def test_a_folder_that_may_not_be_written_is_told_before_anything_is_baked(
    cove: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("paradize.jobs.pool.run_jobs", lambda *_, **__: pytest.fail("was baked"))
    monkeypatch.setattr("os.access", lambda *_: False)
    assert main(["maps", str(cove.parent / "wood.png"), "-o", str(tmp_path / "new")]) == 1
    assert f"{tmp_path} is not yours to write, or read-only; name another place with -o" in (
        capsys.readouterr().err
    )


@pytest.mark.parametrize("form", ["text", "json", "junit", "sarif"])
def test_check_fails_on_errors_in_every_format(run_here: Run, tmp_path: Path, form: str) -> None:
    (tmp_path / "a.glb").write_bytes(b"no mesh")
    result = run_here("check", tmp_path / "a.glb", "--format", form)
    assert result.returncode == 1 and "PZ102" in result.stdout and result.stderr == ""
    assert json.loads(run_here("check", tmp_path / "a.glb", "--json").stdout)["errors"] == 1


@pytest.mark.parametrize(
    "number", sweep([signal.SIGINT, signal.SIGTERM, signal.SIGHUP], test=[signal.SIGINT])
)
def test_an_interrupted_bake_leaves_nothing_half(
    tmp_path: Path, root: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    scene = make_cove(tmp_path / "scene")
    environment = {**os.environ, "PARADIZE_STORE": str(tmp_path / "store")}
    command = [
        str(root / "build/venv/bin/paradize"),
        "bake",
        str(scene),
        "-o",
        str(tmp_path / "out"),
        "-j",
        "1",
    ]
    with started(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        while not (tmp_path / "store/products").is_dir():
            with pytest.raises(subprocess.TimeoutExpired):  # it still runs
                process.wait(0.01)
        process.send_signal(number)
        _, result = process.communicate(timeout=300)
    assert process.returncode == 130 and "interrupted" in result and "Traceback" not in result
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    assert main([*command[1:], "--json"]) == 0


def test_output_into_a_closed_pipe_is_no_traceback(root: Path, cove: Path) -> None:
    command = f"{root}/build/venv/bin/paradize check {cove.parent}/nothing/* | true"
    result = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=300)
    assert "Traceback" not in result.stderr
