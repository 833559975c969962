"""Keys hash the code that is loaded: a stale module or library never passes for the one on disk."""

from __future__ import annotations

import importlib.util
import inspect
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib.machinery import EXTENSION_SUFFIXES, SourceFileLoader
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import paradize
from paradize.bakers import registry
from paradize.build.bake import bake
from paradize.jobs import code, libraries
from paradize.jobs.code import code_digest, code_of, kernel_digest, loaded_kernel_digest
from paradize.jobs.loader import LOADED, CheckedLoader
from paradize.jobs.pool import Job, run_jobs
from paradize.kernels import digest
from paradize.kernels.gutter import _gutter
from tests.pipeline.code_jobs import import_late, mark, run_and_tell
from tests.pipeline.own_package import copy_package, kernels
from tests.pipeline.scenes import make_cove, write_image
from tests.sweeps import sweep


def test_every_kernel_carries_a_digest_of_its_own() -> None:
    found = [re.findall(rb"paradize-kernel-digest:([0-9a-f]{64})\0", path.read_bytes()) for path in kernels()]
    assert len(found) >= 12 and all(len(digests) == 1 for digests in found)
    assert len({digests[0] for digests in found}) == len(found)


def test_the_digest_of_a_loaded_kernel_stays_when_its_file_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / Path(_gutter.__file__).name
    shutil.copy(_gutter.__file__, path)
    spec = importlib.util.spec_from_file_location("paradize.kernels.gutter._gutter", path)
    assert spec is not None
    importlib.util.module_from_spec(spec)
    was = kernel_digest(path)
    assert loaded_kernel_digest(str(path)) == was
    other = tmp_path / "other.so"
    other.write_bytes(path.read_bytes().replace(was.encode(), b"0" * 64))
    other.replace(path)
    assert kernel_digest(path) == "0" * 64 and loaded_kernel_digest(str(path)) == was


def test_a_kernel_s_digest_follows_sources_headers_and_flags(tmp_path: Path) -> None:
    (tmp_path / "a.cpp").write_text('#include "a.hpp"\n#include <vector>\n')
    (tmp_path / "a.hpp").write_text('# include "b.hpp"\n')
    (tmp_path / "b.hpp").write_text("int b();\n")
    (tmp_path / "c.hpp").write_text("int c();\n")
    sources = [tmp_path / "a.cpp"]
    assert [path.name for path in digest.all_files(sources)] == ["a.cpp", "a.hpp", "b.hpp"]
    seen = [digest.digest_of("-O3", sources)]
    (tmp_path / "c.hpp").write_text("int d();\n")
    assert digest.digest_of("-O3", sources) == seen[0]
    seen.append(digest.digest_of("-O2", sources))
    for name in ("a.cpp", "a.hpp", "b.hpp"):
        with (tmp_path / name).open("a") as stream:
            stream.write("// changed\n")
        seen.append(digest.digest_of("-O3", sources))
    assert len(set(seen)) == 5


def test_the_build_finds_the_digest_s_modules_in_python_alone(root: Path, tmp_path: Path) -> None:
    """Not in the folder of the script, which holds a `math` of ours, nor where the user's own modules lie."""
    commands = re.findall(
        r"&& (\S+(?: -\w+)? \S+/digest\.py) ", (root / "build/kernels/build.ninja").read_text()
    )
    assert len(commands) >= 12
    for name in ("hashlib", "re", "pathlib"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('own')\n")
    words = [*commands[0].split(), tmp_path / "out.cpp", "-O3"]
    subprocess.run(words, env={"PYTHONPATH": str(tmp_path)}, check=True)
    assert "paradize-kernel-digest:" in (tmp_path / "out.cpp").read_text()


def test_what_is_written_at_the_build_is_written_once(tmp_path: Path) -> None:
    source, out = tmp_path / "a.cpp", tmp_path / "digest.cpp"
    source.write_text("int a;\n")
    digest.main(str(out), "-O3", str(source))
    os.utime(out, (1, 1))
    digest.main(str(out), "-O3", str(source))
    assert out.stat().st_mtime == 1
    digest.main(str(out), "-O2", str(source))
    assert out.stat().st_mtime > 1


def test_a_text_of_the_same_time_and_size_is_compiled_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where Python's own cache would run the old one."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    path = tmp_path / "late.py"

    def value(loader: type[SourceFileLoader]) -> Any:
        space: dict[str, Any] = {}
        exec(loader("late", str(path)).get_code("late"), space)
        return space["x"]

    hashes = []
    for x in (1, 2, 2):
        path.write_text(f"x = {x}\n")
        os.utime(path, ns=(10**18, 10**18))
        assert value(CheckedLoader) == x
        hashes.append(LOADED.pop("late"))
        stale = value(SourceFileLoader)
    assert stale == 1, "Python's cache noticed: this test shows nothing"
    assert hashes[0] != hashes[1] == hashes[2]
    (kept,) = (tmp_path / "__pycache__").glob("*.by-hash.pyc")
    damaged = bytearray(kept.read_bytes())
    damaged[-3] ^= 1
    kept.write_bytes(damaged)
    assert value(CheckedLoader) == 2
    LOADED.pop("late")


def test_a_worker_whose_code_is_not_the_parent_s_refuses_the_task(tmp_path: Path) -> None:
    true = dict(code_of("paradize.bakers.sound"))
    jobs = [
        Job("own", mark, {"path": tmp_path / "own"}, code=true),
        Job("other text", mark, {"path": tmp_path / "text"}, code=true | {"paradize.errors": "0" * 64}),
        Job("other libraries", mark, {"path": tmp_path / "libs"}, code=true | {"libraries": "0" * 64}),
    ]
    own, *refused = run_jobs(jobs, 1)
    assert (own.value, own.error) == ("done", None)
    for outcome, name in zip(refused, ("paradize.errors", "libraries"), strict=True):
        assert f"{name} is not the code that this bake began with" in str(outcome.error)
    assert [path.name for path in tmp_path.iterdir()] == ["own"]


LATE = ["paradize.stages.gutter", "paradize.kernels.gutter._gutter"]


@pytest.mark.parametrize("module", sweep(LATE, test=LATE[1:]))
def test_what_was_made_by_code_that_came_later_is_refused(tmp_path: Path, module: str) -> None:
    expected = dict(code_of("paradize.build.measurements.gutter_limits"))
    good = Job("late", import_late, {"path": tmp_path / "good"}, code=expected)
    bad = Job("late", import_late, {"path": tmp_path / "bad"}, code=expected | {module: "0" * 64})
    assert run_jobs([good], 1)[0].value == "done"
    (outcome,) = run_jobs([bad], 1)
    assert outcome.value is None and module in str(outcome.error) and (tmp_path / "bad").exists()


@pytest.mark.parametrize(
    "bakers", sweep([["mesh", "authored"], [*registry.BAKERS]], test=[["mesh", "authored"]])
)
def test_keys_cover_all_code_that_a_baker_loads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bakers: list[str]
) -> None:
    """Each in a worker of its own, on a real order of a scene."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    job_of: dict[str, Job] = {}

    def note(jobs: list[Job], workers: int, on_outcome: Any, **others: Any) -> None:
        for job in jobs:
            baker = next(name for name, (_, call) in registry.BAKERS.items() if call is job.call)
            job_of.setdefault(baker, job)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("paradize.build.work.run_jobs", note)
        scene = make_cove(tmp_path / "scene")
        drawn = '[object.material.wood]\nnormal = "bumps.png"'
        scene.write_text(scene.read_text().replace("[object.material.wood]", drawn))
        tilts = np.random.default_rng(3).integers(118, 139, (32, 32, 2), np.uint8)
        bumps = np.dstack([tilts, np.full((32, 32), 255, np.uint8)])
        write_image(scene.parent / "bumps.png", bumps)
        bake(scene, tmp_path / "out")
    assert job_of.keys() == registry.BAKERS.keys()
    every_worker = {"paradize.errors", "paradize.kernels", "paradize.kernels.threads"}
    for baker in bakers:
        job = job_of[baker]
        (outcome,) = run_jobs([Job(baker, run_and_tell, {"baker": baker, "arguments": job.arguments})], 1)
        assert outcome.error is None
        loaded = {name for name in outcome.value if not name.startswith(code._ENGINE_PACKAGES)}
        assert len(loaded) > 2
        assert loaded - job.code.keys() <= every_worker, baker


@pytest.mark.parametrize("baker", registry.BAKERS)
def test_keys_cover_the_modules_that_a_bakers_function_imports(baker: str) -> None:
    module, call = registry.BAKERS[baker]
    imported = re.findall(r"from (paradize\.\S+) import", inspect.getsource(call))
    assert imported and {*imported} <= code_of(module).keys()


def test_the_engine_is_no_part_of_a_key() -> None:
    assert any(path.name == "pool.py" for path in code.code_files("paradize.bakers.mesh.atlas"))
    assert not [
        name for name in code_of("paradize.bakers.mesh.atlas") if name.startswith(code._ENGINE_PACKAGES)
    ]


def test_a_changed_module_or_kernel_bakes_its_products_and_no_others(
    tmp_path: Path, cove_store: Callable[[Path], Path]
) -> None:
    """On a copy of the package, whose products the store has: nobody raises a version, and what is only
    touched is a hit."""
    scene = make_cove(tmp_path / "scene")
    package, store = copy_package(tmp_path / "path"), cove_store(tmp_path / "store")
    script = (
        "import sys; from pathlib import Path; import paradize\n"
        "from paradize.build.bake import bake; from paradize.build.options import BuildOptions\n"
        f"assert list(paradize.__path__) == [{str(package)!r}], paradize.__path__\n"
        "report = bake(Path(sys.argv[1]), Path(sys.argv[2]), BuildOptions(jobs=1))\n"
        "assert not report.errors, report.errors\n"
        "print(*[row['name'] for row in report.rows if row['status'] == 'baked'])"
    )

    def baked() -> set[str]:
        environment = {"PYTHONPATH": str(package.parent), "PARADIZE_STORE": str(store)}
        done = subprocess.run(
            [sys.executable, "-c", script, scene, tmp_path / "out"],
            capture_output=True,
            text=True,
            timeout=300,
            env={**os.environ, **environment},
        )
        assert done.returncode == 0, done.stderr
        return set(done.stdout.split())

    for name in ("bakers/cubemap.py", "kernels/gutter/_gutter" + EXTENSION_SUFFIXES[0]):
        os.utime(package / name)
    with (package / "bakers/sound.py").open("a") as stream:
        stream.write("# changed\n")
    kernel = package / "kernels/terrain" / ("_terrain" + EXTENSION_SUFFIXES[0])
    other = kernel.read_bytes().replace(kernel_digest(kernel).encode(), b"1" * 64)
    kernel.unlink()
    kernel.write_bytes(other)
    assert baked() == {"sound", "terrain_mesh"}


def test_a_bake_of_one_process_looks_at_its_code_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    before = code_digest("paradize.bakers.sound")
    monkeypatch.setattr(libraries, "LIBRARIES", ())
    assert code_digest("paradize.bakers.sound") == before
    code.clear_caches()
    try:
        assert code_digest("paradize.bakers.sound") != before
    finally:
        monkeypatch.undo()
        code.clear_caches()


def test_code_that_is_saved_replaced_or_added_is_seen_by_the_next_bake_of_one_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where size and time are as before, as an archive restores them."""
    monkeypatch.setattr(paradize, "__path__", [str(tmp_path), *paradize.__path__])
    own = tmp_path / "own.py"

    def seen(text: str = "") -> dict[str, str]:
        if text:
            new = tmp_path / "new"
            new.write_text(text)
            os.utime(new, (1e9, 1e9))
            new.replace(own)
        code.clear_caches()
        return {name: digest for name, digest in code_of("paradize.own").items() if "own" in name}

    try:
        first = seen("from paradize import own_b\n")
        assert list(first) == ["paradize.own"]
        (tmp_path / "own_b.py").write_text("VALUE = 1\n")
        added = seen()
        assert (
            set(added) == {"paradize.own", "paradize.own_b"}
            and added["paradize.own"] == first["paradize.own"]
        )
        with (tmp_path / "own_b.py").open("a") as stream:
            stream.write("VALUE = 2\n")
        saved = seen()
        assert saved["paradize.own_b"] != added["paradize.own_b"]
        replaced = seen("from paradize import own_c\n")
        assert set(replaced) == {"paradize.own"} and replaced != first
    finally:
        monkeypatch.undo()
        code.clear_caches()
