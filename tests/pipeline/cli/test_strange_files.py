"""No command waits, reads for ever or breaks where a pipe, a device or a folder stands in a file's place."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from tests.pipeline.scenes import make_cove
from tests.pipeline.strange_files import MANY, SAID, VAST, makes_devices
from tests.sweeps import sweep

SOURCES = [
    "cove.toml", "height.png", "sand.png", "wood.png", "waves.png", "px.exr", "post.obj", "sea.ogg",
]  # fmt: skip
MANIFEST, OBJECT, GROUND = "out/scene.json", "out/post_mesh-*.glb", "out/terrain_mesh-*.glb"
COLORS = "out/*_color-*.ktx2"
ARTIFACTS = [MANIFEST, OBJECT, GROUND, COLORS, "out/*.ogg"]
SIZE = ["--size", "10", "10", "--height", "2"]
# The call, the spoilt file, and whether the command refuses (1) or does without (0).
TRIED: dict[str, tuple[list[str], list[str], int]] = {
    "bake, a source": (["bake", "cove.toml", "-o", "out"], SOURCES, 1),
    "bake, what it names": (["bake", "own.toml", "-o", "new"], ["post.mtl", "wood.png"], 1),
    "bake, an artifact": (["bake", "cove.toml", "-o", "out"], ARTIFACTS, 0),
    "bake, an entry of the store": (["bake", "cove.toml", "-o", "out"], ["store/bakes/*"], 0),
    "bake, the store's lock": (["bake", "cove.toml", "-o", "out"], ["store/locks/*"], 1),
    "explain, a source": (["explain", "cove.toml", "-o", "out"], SOURCES, 1),
    "explain, an artifact": (["explain", "cove.toml", "-o", "out"], [*ARTIFACTS, "store/bakes/*"], 0),
    "export": (["export", "out", "-o", "x.glb"], [MANIFEST, OBJECT], 1),
    "check": (["check", "out"], ARTIFACTS, 1),
    "check, the manifest": (["check", "out"], [MANIFEST], 1),
    "check of a file": (["check", "wood.png"], ["wood.png"], 1),
    "check --against": (["check", "out", "--against", "earlier"], ["earlier/scene.json"], 1),
    "check of several": (["check", "several"], ["several/a.glb", "several/b.png"], 1),
    "mesh": (["mesh", "post.obj", "-o", "m.glb"], ["post.obj"], 1),
    "mesh, what it names": (["mesh", "post.obj", "-o", "m.glb"], ["post.mtl", "wood.png"], 1),
    "maps": (["maps", "wood.png", "-o", "m", "--uv", "post.obj"], ["wood.png", "post.obj"], 1),
    "terrain": (["terrain", "height.png", "-o", "t.glb", *SIZE], ["height.png"], 1),
    "terrain, raw": (["terrain", "raw.hgt", "-o", "t.glb", *SIZE], ["raw.hgt"], 1),
    "measure": (["measure", "wood.png", "-o", "m"], ["wood.png"], 1),
    "measure of a scene": (["measure", "cove.toml", "-o", "m"], ["cove.toml"], 1),
    "new": (["new", "n", "--from", "post.obj"], ["post.obj"], 1),
    "new, what it names": (["new", "n", "--from", "post.obj"], ["post.mtl", "wood.png"], 1),
    "clean": (["clean"], ["store/bakes/*", "store/products/*/*", "store/blobs/*/*"], 0),
}
# Places where a command only looks whether a name is there, or that are written over, take fewer kinds.
FEW = ["pipe", "endless"]
MORE = [kind for kind in MANY if kind not in FEW]
EVERY = ["check", "check of several", "mesh", "maps", "explain, a source", "explain, an artifact"]
EVERY += [what for what in TRIED if what.endswith("what it names")]


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> Path:
    """The cove, baked with a store of its own."""
    top = tmp_path_factory.mktemp("base")
    scene = make_cove(top)
    (top / "raw.hgt").write_bytes(b"\0\1" * 16)
    (top / "own.toml").write_text(
        scene.read_text().replace('color = "wood.png"\n', "")
    )  # which post.mtl names
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(cove_store(top / "store")))
        assert not bake(scene, top / "out", BuildOptions(jobs=1)).errors
    shutil.copytree(top / "out", top / "earlier")
    (top / "several").mkdir()
    shutil.copy(next(top.glob(OBJECT)), top / "several/a.glb")
    shutil.copy(top / "wood.png", top / "several/b.png")
    return top


Case = tuple[list[str], list[str], list[str]]  # words, places, kinds
Ended = tuple[str, str, int, str, int]


def tried(words: list[str], places: list[str], kinds: list[str], base: Path, work: Path) -> list[Ended]:
    """The outcome for each place and kind."""
    (ended,) = all_tried([(words, places, kinds)], base, work)
    return ended


def all_tried(cases: list[Case], base: Path, work: Path) -> list[list[Ended]]:
    """The same of several cases, in one process. It is ended by its own alarm if one hangs."""
    call = [sys.executable, "-m", "tests.pipeline.strange_files", json.dumps(cases)]
    ran = subprocess.run([*call, str(base), str(work)], capture_output=True, text=True, timeout=1200)
    report = iter([json.loads(line) for line in ran.stdout.splitlines()])
    ended = [[tuple(line) for line in islice(report, len(places) * len(kinds))] for _, places, kinds in cases]
    assert ran.returncode == 0 and len(ended[-1]) == len(cases[-1][1]) * len(cases[-1][2]), ran.stderr
    return ended


# Of the others one that reads files in the same way is quick: `explain` and `bake` read a scene's sources.
SLOW = ["explain, an artifact", "export", "bake, an artifact", "mesh, what it names", "maps", "terrain, raw"]
SLOW += ["explain, a source", "bake, an entry of the store", "measure of a scene", "new", "check", "clean"]
QUICK = [(what, ["pipe"]) for what in TRIED if what not in SLOW and what != "check, the manifest"]
QUICK += [(what, ["endless", *MORE]) for what in ("check, the manifest", "check of several")]


@pytest.fixture(scope="module")
def quick(base: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], list[Ended]]:
    """The outcomes of the quick cases, by what is called and the first kind. One process tries them all."""
    every = [*QUICK, ("check", ["vast"])]
    cases = [(*TRIED[what][:2], _makeable(kinds)) for what, kinds in every]
    cases.append((["check", "out"], [COLORS], ["pipe"]))
    every.append(("check, colours", ["pipe"]))
    ended = all_tried(cases, base, tmp_path_factory.mktemp("quick") / "work")
    return {(what, kinds[0]): one for (what, kinds), one in zip(every, ended, strict=True)}


def _makeable(kinds: list[str]) -> list[str]:
    return kinds if makes_devices() else [kind for kind in kinds if kind != "endless"]


REST = [(what, ["endless", *MORE] if what in EVERY else ["endless"]) for what in TRIED]
REST += [(what, ["pipe"]) for what in SLOW]


@pytest.mark.parametrize(
    ("what", "kinds"),
    sweep(QUICK + [case for case in REST if case not in QUICK], test=QUICK),
)
def test_a_command_ends_whatever_stands_in_a_files_place(
    what: str,
    kinds: list[str],
    base: Path,
    tmp_path: Path,
    quick: dict[tuple[str, str], list[Ended]],
) -> None:
    words, places, wanted = TRIED[what]
    if (what, kinds) in QUICK:
        ended = quick[what, kinds[0]]
    else:
        ended = tried(words, places, _makeable(kinds), base, tmp_path / "work")
    for place, kind, code, said, _ in ended:
        missing = kind in ("nowhere", "folder")
        due = 0 if missing and what.endswith("what it names") else wanted
        assert code == due, (place, kind, code, said)
        assert "internal error" not in said and "Traceback" not in said, (place, kind, said)
        if code == 1:
            name = place.rpartition("/")[2].strip("*").partition("-")[0]
            assert name in said, (place, kind, said)
            result = SAID[kind] in said or (missing and "is a link that leads to nothing" in said)
            assert result, (place, kind, said)
            assert "did you mean" not in said and "there is no file" not in said, (place, kind, said)


@pytest.mark.deep
def test_a_bake_takes_the_place_of_a_pipe_of_its_name_and_leaves_a_folder(base: Path, tmp_path: Path) -> None:
    words, work = ["bake", "cove.toml", "-o", "out"], tmp_path / "work"
    for place in (MANIFEST, GROUND):
        ((_, _, code, said, _),) = tried(words, [place], ["listener"], base, work)
        assert code == 0, said
        for good in base.glob(place):
            assert (work / "out" / good.name).read_bytes() == good.read_bytes()
        ((_, _, code, said, _),) = tried(words, [place], ["folder"], base, work)
        assert code == 1 and "is a folder; move it away" in said, said
        ((_, _, code, said, _),) = tried(["check", "out"], [place], ["folder"], base, work)
        assert code == 1 and "move it away, then bake again" in said, said


READ_BAKED = [what for what, (_, places, _) in TRIED.items() if MANIFEST in places and len(places) > 1]


@pytest.mark.parametrize("what", sweep(READ_BAKED, test=["check"]))
def test_no_command_reads_a_baked_file_that_is_larger_than_it_may_be(
    what: str, base: Path, tmp_path: Path, quick: dict[tuple[str, str], list[Ended]]
) -> None:
    words, places, wanted = TRIED[what]
    places = [place for place in places if not place.startswith("store/")]
    known = quick.get((what, "vast"))
    for place, _, code, said, held in known or tried(words, places, ["vast"], base, tmp_path / "work"):
        assert code == wanted and held < VAST, (place, code, held, said)
        if code == 1:
            assert f"holds {VAST} bytes, limit " in said, (place, said)


def test_check_tells_a_strange_artifact_beside_the_findings_of_others(
    base: Path, quick: dict[tuple[str, str], list[Ended]]
) -> None:
    ((_, _, _, said, _),) = quick["check, colours", "pipe"]
    assert said.count("error PZ101") == len(list(base.glob(COLORS)))


@pytest.mark.deep
def test_strange_entries_of_the_store_are_made_anew(base: Path, tmp_path: Path) -> None:
    """Also of one that is shared: what is not a file there counts as damaged, not as a store that is away."""
    work, shared = tmp_path / "work", tmp_path / "shared"
    for name in ("products", "blobs"):
        entries = sorted(path for path in (base / "store" / name).glob("*/*"))[:3]
        for entry in entries:
            place = shared / entry.relative_to(base / "store")
            place.parent.mkdir(parents=True, exist_ok=True)
            os.mkfifo(place)
    places = [
        str(path.relative_to(base))
        for name in ("products", "blobs")
        for path in sorted((base / "store" / name).glob("*/*"))[:1]
    ]
    words = ["bake", "cove.toml", "-o", "new", "--store", str(shared)]
    for place, kind, code, said, _ in tried(words, places, FEW, base, work):
        assert code == 0, (place, kind, said)
        assert "cannot be used" not in said and "Traceback" not in said, said
        assert (work / place).is_file()
