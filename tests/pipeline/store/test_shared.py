"""Shared stores: what one bakes another fetches, verified; what is damaged, hostile, slow or away never stops
a bake. Over a real socket: asyncssh's server, and OpenSSH's where it is installed (ssh_server.py)."""

from __future__ import annotations

import gc
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.errors import BakeError
from paradize.store import remote_folder as place
from paradize.store.atomic import PARTIAL
from paradize.store.local import Store, hashes_in, seal
from paradize.store.remote_folder import RemoteFolder, shown
from paradize.store.shared import SharedStore
from tests.pipeline.bakes import bake_apart
from tests.pipeline.scenes import make_cove, make_free_cove
from tests.pipeline.ssh_server import Home, asyncssh_server, asyncssh_servers, openssh_server, url_of
from tests.processes import started
from tests.sweeps import sweep

KEYS = [f"{i:02x}" * 32 for i in range(6)]
# Where a server dies, asyncssh leaves the file that it was writing to the garbage collector.
left_open = pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("PARADIZE_REPORT", "")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.delenv("SSH_AUTH_SOCK", raising=False)
    yield
    gc.collect()  # what a test left open is told in that test


@pytest.fixture(scope="module")
def servers() -> Iterator[subprocess.Popen[str]]:
    with asyncssh_servers() as process:
        yield process


@pytest.fixture
def home(tmp_path: Path, servers: subprocess.Popen[str]) -> Home:
    return Home(tmp_path / "home", servers)


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with scene/cove.toml, its bake in out, and the store of that."""
    top = tmp_path_factory.mktemp("cove")
    scene = make_free_cove(top / "scene")  # more levels are measured, which takes longer than all else
    scene.write_text(scene.read_text().replace("lods = 3", "lods = 1"))
    bake_apart(scene, top)
    yield top


@contextmanager
def remote_at(kind: str, home: Home, folder: Path) -> Iterator[str]:
    """The URL of the folder, by a server of that kind."""
    if kind == "folder":
        yield str(folder)
        return
    with (openssh_server if kind == "sshd" else asyncssh_server)(home) as port:
        yield url_of(port, folder)


def state_of(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(out.iterdir())}


def seed(baked: Path, remote: Path) -> None:
    """Shares what was baked in a folder."""
    for name in ("blobs", "products"):
        shutil.copytree(baked / "store" / name, remote / name)
    for path in (remote / "products").glob("*/*"):
        if is_of_a_model(path.read_bytes()):
            path.unlink()


def is_of_a_model(product: bytes) -> bool:
    """Whether it says what was found out about a model. That names folders of this machine: it is not
    shared."""
    return b'\n{"materials"' in product


def bake_shared(baked: Path, url: str, out: Path, **more: Any) -> BakeReport:
    report = bake(baked / "scene" / "cove.toml", out, BuildOptions(store=url, **more))
    assert not report.errors and state_of(out) == state_of(baked / "out")
    return report


def warnings_of(report: BakeReport) -> str:
    """Its warnings about the shared store."""
    return "\n".join(text for text in report.warnings if text.startswith("--store"))


@contextmanager
def shared(root: Path, url: str) -> Iterator[SharedStore]:
    store = SharedStore(root, url)
    with store.in_use():
        yield store


def push_all(root: Path, url: str, count: int = len(KEYS)) -> list[str]:
    """Pushes products of one blob each; returns the warnings."""
    with shared(root, url) as store:
        for key in KEYS[:count]:
            store.put_product(key, {"x": {"sha256": store.put(key.encode() * 1000), "suffix": "glb"}})
        return store.settle()


def fetch_all(root: Path, url: str, count: int = len(KEYS)) -> tuple[list[bytes | None], list[str]]:
    """The blobs of what `push_all` pushed, as far as they come, and the warnings."""
    with shared(root, url) as store:
        store.expect(KEYS[:count])
        products = [store.get_product(key) for key in KEYS[:count]]
        blobs = [product and store.get(product["x"]["sha256"]) for product in products]
        return blobs, store.settle()


ALL = [key.encode() * 1000 for key in KEYS]


@pytest.mark.parametrize("kind", sweep(["folder", "asyncssh", "sshd"], test=["asyncssh", "sshd"]))
def test_what_one_bakes_another_fetches_and_bakes_nothing(
    kind: str, baked: Path, home: Home, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with remote_at(kind, home, tmp_path / "remote" / "deep") as url:
        shutil.copytree(baked / "store", tmp_path / "store")  # a bake that shared nothing yet
        first = bake_shared(baked, url, tmp_path / "first")
        assert (first.count("reused"), first.fetched, first.pushed, warnings_of(first)) == (14, 0, 14, "")
        monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "empty"))
        second = bake_shared(baked, url, tmp_path / "second")
        assert (second.count("baked"), second.fetched, second.pushed, warnings_of(second)) == (0, 14, 0, "")
        again = bake_shared(baked, url, tmp_path / "second")
        assert (again.count("reused"), again.fetched, again.pushed) == (14, 0, 0)
    assert not list((tmp_path / "remote").rglob("*.part-*"))


@pytest.mark.deep
def test_an_artifact_whose_finest_levels_are_left_out_is_counted_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = make_cove(tmp_path / "scene")
    words = scene.read_text().replace("poster_s", "viewport = [64, 36]\nposter_s")
    for near, far in ((" 9", " 90"), ("-9", "-90"), ("[9", "[90")):
        words = words.replace(near, far)
    scene.write_text(words)
    counts = []
    for name in ("first", "second"):
        monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / name / "store"))
        report = bake(scene, tmp_path / name / "out", BuildOptions(store=str(tmp_path / "remote")))
        assert any(one.left_out for one in report.artifacts)
        counts.append((report.fetched, report.pushed))
    assert counts == [(0, 14), (14, 0)]


@pytest.mark.deep
def test_two_bakes_that_push_at_once_leave_all_of_it(baked: Path, home: Home, tmp_path: Path) -> None:
    with asyncssh_server(home) as port:
        url = url_of(port, tmp_path / "remote")
        command = [sys.executable, "-m", "paradize.cli.main", "bake", str(baked / "scene" / "cove.toml")]
        with ExitStack() as stack:
            both = [
                stack.enter_context(
                    started(
                        [*command, "-j", "1", "--json", "--store", url, "-o", tmp_path / name / "out"],
                        stdout=subprocess.PIPE,
                        stderr=subprocess.DEVNULL,
                        env=os.environ | {"PARADIZE_STORE": str(tmp_path / name / "store")},
                    )
                )
                for name in ("a", "b")
            ]
            reports = [json.loads(process.communicate(timeout=300)[0]) for process in both]
        assert all(report["baked"] + report["fetched"] == 14 for report in reports)
        assert not [text for report in reports for text in report["warnings"] if "--store" in text]
        assert state_of(tmp_path / "a" / "out") == state_of(tmp_path / "b" / "out")
        assert bake_shared(baked, url, tmp_path / "third").fetched == 14


@pytest.mark.parametrize("kind", sweep(["folder", "asyncssh"], test=["folder"]))
def test_a_flipped_bit_there_is_found_derived_again_and_mended(
    kind: str, baked: Path, home: Home, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    remote = tmp_path / "remote"
    seed(baked, remote)
    sky = next(path for path in (baked / "out").iterdir() if path.name.startswith("sky-"))
    blob = next((remote / "blobs").glob(f"*/{sky.name[4:12]}*"))
    damaged = bytearray(blob.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    blob.write_bytes(damaged)
    with remote_at(kind, home, remote) as url:
        report = bake_shared(baked, url, tmp_path / "out")
        assert [row["name"] for row in report.rows if row["status"] == "baked"] == ["sky"]
        assert (report.fetched, report.pushed) == (13, 1)
        assert "holds 1 damaged file" in warnings_of(report) and blob.name in warnings_of(report)
        assert blob.read_bytes() == sky.read_bytes()
        monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "another"))
        report = bake_shared(baked, url, tmp_path / "another_out")
        assert report.fetched == 14 and not warnings_of(report)


@pytest.mark.parametrize("kind", sweep(["folder", "asyncssh"], test=["folder"]))
def test_a_pipe_there_is_damage_that_nobody_waits_for(
    kind: str, baked: Path, home: Home, tmp_path: Path
) -> None:
    """Of a product and of a blob: both are made again and take its place."""
    remote = tmp_path / "remote"
    seed(baked, remote)
    spoilt = [next((remote / name).glob("*/*")) for name in ("products", "blobs")]
    for path in spoilt:
        path.unlink()
        os.mkfifo(path)
    with remote_at(kind, home, remote) as url:
        report = bake_shared(baked, url, tmp_path / "out")
    assert report.count("baked") and report.fetched and "damaged file" in warnings_of(report)
    assert all(path.is_file() for path in spoilt)


def test_damaged_products_and_missing_blobs_there_are_mended(tmp_path: Path) -> None:
    remote, url = tmp_path / "remote", str(tmp_path / "remote")
    assert not push_all(tmp_path / "a", url)
    whole = {path: path.read_bytes() for path in remote.rglob("*") if path.is_file()}
    for path, data in whole.items():
        if path.parent.parent.name == "products":
            path.write_bytes(data.replace(b"glb", b"gla"))  # JSON still
    blobs, warnings = fetch_all(tmp_path / "b", url)
    assert blobs == [None] * 6 and "6 damaged files" in warnings[0]
    push_all(tmp_path / "b", url)
    assert {path: path.read_bytes() for path in whole} == whole
    next((remote / "blobs").glob("*/*")).unlink()
    blobs, warnings = fetch_all(tmp_path / "c", url)
    assert blobs.count(None) == 1 and not warnings  # as if it had never been there
    push_all(tmp_path / "c", url)
    assert {path: path.read_bytes() for path in whole} == whole


def test_an_empty_product_there_is_mended_by_a_store_that_has_it(tmp_path: Path) -> None:
    remote = tmp_path / "remote"
    push_all(tmp_path / "a", str(remote), 1)
    (path,) = (remote / "products").glob("*/*")
    whole = path.read_bytes()
    path.write_bytes(b"")
    shutil.rmtree(tmp_path / "a" / "remotes")  # which says that it is there
    with shared(tmp_path / "a", str(remote)) as store:
        assert store.get_product(KEYS[0]) and store.settle() == []
    assert path.read_bytes() == whole


def test_what_did_not_come_and_was_made_here_is_found(tmp_path: Path) -> None:
    url = str(tmp_path / "remote")
    push_all(tmp_path / "a", url, 1)
    next((tmp_path / "remote" / "blobs").glob("*/*")).write_bytes(b"decayed")
    with shared(tmp_path / "b", url) as store:
        assert store.get_product(KEYS[0])
        sha256 = store.put(ALL[0])
        assert store.get(sha256) == ALL[0] and store.find(sha256)


@pytest.mark.parametrize(
    "product",
    [
        {"x": {"sha256": "../../../escaped", "suffix": "glb"}},
        {"x": {"sha256": "ab" * 32, "suffix": "glb/../../../escaped"}},
        ["no product"],
        "no product",
    ],
)
def test_names_that_lead_out_of_the_folder_are_damage(tmp_path: Path, product: Any) -> None:
    path = tmp_path / "remote" / "products" / "aa" / ("aa" * 32)
    path.parent.mkdir(parents=True)
    path.write_bytes(seal(product))
    with shared(tmp_path / "store", str(tmp_path / "remote")) as store:
        assert store.get_product("aa" * 32) is None
        assert "1 damaged file" in store.settle()[0]


@left_open
def test_a_server_killed_in_mid_fetch_is_a_warning_and_the_rest_is_baked(
    baked: Path, home: Home, tmp_path: Path
) -> None:
    seed(baked, tmp_path / "remote")
    with asyncssh_server(home, "--die", "25") as port:
        report = bake_shared(baked, url_of(port, tmp_path / "remote"), tmp_path / "out")
    assert 0 < report.count("baked") < 14 and report.fetched == report.count("reused")
    assert "cannot be used, baked without it" in warnings_of(report)
    assert not list((tmp_path / "store").rglob("*.part-*"))


@left_open
def test_a_server_that_falls_silent_is_given_up(
    home: Home, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with asyncssh_server(home) as port:
        push_all(tmp_path / "a", url_of(port, tmp_path / "remote"))
    monkeypatch.setattr(place, "TIMEOUT_S", 1.5)
    with asyncssh_server(home, "--stop", "4") as port:
        blobs, warnings = fetch_all(tmp_path / "b", url_of(port, tmp_path / "remote"))
    assert blobs.count(None) >= 3 and "cannot be used" in warnings[0]


def test_where_the_host_cannot_be_reached_all_is_baked_and_shared_the_next_time(
    baked: Path, home: Home, tmp_path: Path
) -> None:
    with asyncssh_server(home) as port:
        url = url_of(port, tmp_path / "remote")
    report = bake_shared(baked, url, tmp_path / "out")  # nobody listens there
    assert (report.count("baked"), report.pushed) == (14, 0) and warnings_of(report).count("\n") == 0
    assert "cannot be used, baked without it" in warnings_of(report)
    report = bake_shared(baked, str(tmp_path / "remote"), tmp_path / "out")  # nothing changed
    assert (report.count("reused"), report.pushed, warnings_of(report)) == (14, 14, "")


def test_who_is_not_let_in_or_not_known_is_told_why(home: Home, tmp_path: Path) -> None:
    with asyncssh_server(home) as port:
        url = url_of(port, tmp_path / "remote")
        home.know(port, home.user_key)  # another host's key
        assert "cannot be used" in fetch_all(tmp_path / "a", url)[1][0]
        (home.path / ".ssh" / "known_hosts").unlink()
        assert "Host key is not trusted" in fetch_all(tmp_path / "a", url)[1][0]
        home.know(port)
        (home.path / ".ssh" / "id_ed25519").rename(home.path / "away")
        assert "Permission denied" in fetch_all(tmp_path / "a", url)[1][0]
        (home.path / "away").rename(home.path / ".ssh" / "id_ed25519")
        assert not push_all(tmp_path / "a", url)


def test_hosts_may_be_named_as_in_the_configuration_of_ssh(home: Home, tmp_path: Path) -> None:
    with asyncssh_server(home) as port:
        text = f"Host studio\n  HostName 127.0.0.1\n  Port {port}\n"
        (home.path / ".ssh" / "config").write_text(text)
        assert not push_all(tmp_path / "a", f"ssh://studio{tmp_path}/remote")
    assert fetch_all(tmp_path / "b", str(tmp_path / "remote")) == (ALL, [])


def test_a_store_that_may_only_be_read_gives_and_takes_nothing(home: Home, tmp_path: Path) -> None:
    push_all(tmp_path / "a", str(tmp_path / "remote"), 4)
    with asyncssh_server(home, "--read-only") as port:
        url = url_of(port, tmp_path / "remote")
        assert fetch_all(tmp_path / "b", url, 4) == (ALL[:4], [])
        warnings = push_all(tmp_path / "b", url)
        assert (
            len(warnings) == 1 and "takes nothing" in warnings[0] and "this store is read only" in warnings[0]
        )
        assert fetch_all(tmp_path / "c", url, 4) == (ALL[:4], [])
    assert len(list((tmp_path / "remote" / "products").glob("*/*"))) == 4


def test_blobs_go_before_the_product_that_names_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a push that ends anywhere leaves nothing that misses a file."""
    names: list[str] = []
    write = RemoteFolder.write

    def noted(self: RemoteFolder, name: str, data: bytes | Path) -> None:
        names.append(name.split("/")[0])
        if len(names) == 3:
            raise OSError("the line is cut")
        write(self, name, data)

    monkeypatch.setattr(RemoteFolder, "write", noted)
    with shared(tmp_path / "store", str(tmp_path / "remote")) as store:
        hashes = [store.put(bytes([i])) for i in range(3)]
        store.put_product("aa" * 32, {str(i): {"sha256": sha256} for i, sha256 in enumerate(hashes)})
        assert not store.settle()  # the second try
    assert names == ["blobs"] * 4 + ["products"]


@pytest.mark.parametrize("count", [1, 4, 9, 16, 25])
@pytest.mark.deep  # blobs go before the product that names them: above
def test_a_push_that_is_killed_leaves_nothing_that_misses_a_file(
    baked: Path, tmp_path: Path, count: int
) -> None:
    """Killed as so many files are written there; the next bake pushes the rest."""
    remote, url = tmp_path / "remote", str(tmp_path / "remote")
    command = [sys.executable, "-m", "paradize.cli.main", "bake", str(baked / "scene" / "cove.toml")]
    shutil.copytree(baked / "store", tmp_path / "store")
    words = [*command, "-o", tmp_path / "out", "--store", url]
    with started(words, stdout=subprocess.DEVNULL) as process:
        while process.poll() is None and sum(path.is_file() for path in remote.rglob("*")) < count:
            pass
        process.kill()
        process.wait()
    products = [path for path in remote.glob("products/*/*") if PARTIAL not in path.name]
    for path in products:
        assert all(Store(remote).find(sha256) for sha256 in hashes_in(Store.read_entry(path)))
    bake_shared(baked, url, tmp_path / "out")
    own = state_of_all(baked / "store", "products")
    shared = {name: data for name, data in own.items() if not is_of_a_model(data)}
    assert len(shared) == len(own) - 1
    assert state_of_all(remote, "products") == shared
    assert state_of_all(remote, "blobs") == state_of_all(baked / "store", "blobs")


def state_of_all(root: Path, kind: str) -> dict[str, bytes]:
    files = [path for path in (root / kind).glob("*/*") if PARTIAL not in path.name]
    return {path.name: path.read_bytes() for path in files}


def test_an_upload_that_breaks_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fsspec.implementations.local import LocalFileSystem

    def broken(self: LocalFileSystem, old: str, new: str, **more: Any) -> None:
        raise OSError("the line is cut")

    monkeypatch.setattr(LocalFileSystem, "mv", broken)
    assert "the line is cut" in push_all(tmp_path / "store", str(tmp_path / "remote"))[0]
    assert not [path for path in (tmp_path / "remote").rglob("*") if path.is_file()]


def test_force_reads_nothing_from_there_and_replaces_it(tmp_path: Path, baked: Path) -> None:
    seed(baked, tmp_path / "remote")
    report = bake_shared(baked, str(tmp_path / "remote"), tmp_path / "out", force=True)
    assert (report.count("baked"), report.fetched, warnings_of(report)) == (14, 0, "")


@pytest.mark.parametrize(
    ("url", "what"),
    [
        ("", "neither a folder nor a URL"),
        ("host:/srv/store", "neither a folder nor a URL"),
        ("s3:/bucket", "neither a folder nor a URL"),
        ("gopher://host/store", "no known protocol"),
        ("sftp://", "neither a folder nor a URL"),
        ("sftp:///srv/store", "names no host"),
        ("sftp://host", "names no folder on the host"),
        ("sftp://host:port/store", "is not a valid URL"),
        ("sftp://host:99999/store", "is not a valid URL"),
        ("file://relative/store", "absolute path"),
        ("s3://bucket/store", "pip install s3fs"),
    ],
)
def test_what_is_no_place_is_refused_before_anything_is_baked(tmp_path: Path, url: str, what: str) -> None:
    if url.startswith("s3://"):
        try:
            import s3fs  # noqa: F401
        except ImportError:
            pass
        else:
            pytest.skip("s3fs is installed here")
    with pytest.raises(BakeError, match=what) as caught:
        SharedStore(tmp_path / "store", url)
    assert "--store" in str(caught.value) and not (tmp_path / "store").exists()


def test_a_store_in_memory_is_a_store(tmp_path: Path) -> None:
    assert not push_all(tmp_path / "a", "memory://studio/store")
    assert fetch_all(tmp_path / "b", "memory://studio/store") == (ALL, [])


def test_passwords_are_told_to_nobody(
    baked: Path, home: Home, tmp_path: Path, paradize_here: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    with asyncssh_server(home) as port:
        url = f"sftp://anna:gehe%21m@127.0.0.1:{port}{tmp_path}/remote?token=gehe%21m"
        (home.path / ".ssh" / "id_ed25519").unlink()
        words = ["bake", str(baked / "scene" / "cove.toml")]
        shutil.copytree(baked / "store", tmp_path / "store")
        done = paradize_here(*words, "-o", tmp_path / "out", "--json", "--store", url)
        refused = paradize_here(*words, "--force", "--store", url.replace("sftp", "gopher"))
    assert done.returncode == 0 and "Permission denied" in json.loads(done.stdout)["warnings"][-1]
    assert refused.returncode == 1 and "no known protocol" in refused.stderr
    texts = [done.stdout, done.stderr, refused.stdout, refused.stderr]
    texts += [
        path.read_bytes().decode("latin1") for path in (tmp_path / "store").rglob("*") if path.is_file()
    ]
    assert not [text for text in texts if "gehe" in text or "token" in text]
    assert shown(url) == f"sftp://anna@127.0.0.1:{port}{tmp_path}/remote"


def test_a_bake_with_nothing_to_do_loads_nothing_of_it(baked: Path, tmp_path: Path) -> None:
    seed(baked, tmp_path / "remote")
    bake_shared(baked, str(tmp_path / "remote"), tmp_path / "out")
    words = ["bake", str(baked / "scene" / "cove.toml"), "-o", str(tmp_path / "out")]
    words += ["--store", str(tmp_path / "remote")]
    script = f"import sys; from paradize.cli.main import main; assert main({words}) == 0; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "nothing to bake" in done.stdout
    assert not {"fsspec", "asyncssh", "sshfs", "concurrent.futures", "numpy"} & set(done.stdout.split())


def test_what_came_from_there_counts_as_used_and_clean_keeps_to_this_machine(tmp_path: Path) -> None:
    from paradize.store.clean import clean

    push_all(tmp_path / "a", str(tmp_path / "remote"))
    assert fetch_all(tmp_path / "b", str(tmp_path / "remote"))[0] == ALL
    there = state_of(next((tmp_path / "remote" / "blobs").iterdir()))
    clean(Store(tmp_path / "b"), now_s=0.0, older_than_s=0.0, max_bytes=None)
    assert Store(tmp_path / "b").get_product(KEYS[0])
    clean(Store(tmp_path / "b"), now_s=0.0, older_than_s=None, max_bytes=0)
    assert not Store(tmp_path / "b").get_product(KEYS[0])
    assert state_of(next((tmp_path / "remote" / "blobs").iterdir())) == there


def test_a_store_of_no_name_is_told_also_where_nothing_changed(
    baked: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of a variable that is not set."""
    monkeypatch.setenv("PARADIZE_STORE", str(baked / "store"))
    with pytest.raises(BakeError, match="neither a folder nor a URL"):
        bake(baked / "scene/cove.toml", baked / "out", BuildOptions(store=""))
