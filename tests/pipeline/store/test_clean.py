"""The store stays bounded, and a bake never misses what it uses."""

from __future__ import annotations

import fcntl
import os
import threading
from pathlib import Path

import pytest

from paradize.store.clean import clean
from paradize.store.local import Store

NOW_S = 1_000_000.0


def keep(store: Store, key: str, *contents: bytes, used_s: float) -> list[str]:
    """A product of these files, last used then; their hashes."""
    hashes = [store.put(data) for data in contents]
    store.put_product(key, {f"file{i}": {"sha256": sha256} for i, sha256 in enumerate(hashes)})
    os.utime(store.root / "products" / key[:2] / key, (used_s, used_s))
    return hashes


def record(store: Store, name: str, hashes: list[str], used_s: float) -> None:
    store.put_bake(name, {"artifacts": [{"sha256": sha256} for sha256 in hashes]})
    os.utime(store.root / "bakes" / name, (used_s, used_s))


def size_of(store: Store) -> int:
    return sum(path.stat().st_size for path in store.root.rglob("*") if path.is_file())


def test_without_limits_only_what_is_of_no_use_goes(tmp_path: Path) -> None:
    store = Store(tmp_path)
    (whole,) = keep(store, "aa1", b"whole", used_s=0.0)
    orphan = store.put(b"orphan")
    lost, left = keep(store, "bb2", b"lost", b"left", used_s=NOW_S)
    (tmp_path / "blobs" / lost[:2] / lost).unlink()
    (tmp_path / "products" / "cc").mkdir()
    (tmp_path / "products" / "cc" / "cc3").write_bytes(b"{damaged")
    (tmp_path / "bakes").mkdir()
    (tmp_path / "bakes" / "dd4").write_bytes(b"{damaged")
    (tmp_path / "blobs" / whole[:2] / ".half.part-0123").write_bytes(b"of a killed writer")
    before = size_of(store)
    (tmp_path / "scratch" / "killed").mkdir(parents=True)
    (tmp_path / "scratch" / "killed" / "tile").write_bytes(b"of a killed worker")
    done = clean(store, now_s=NOW_S, older_than_s=None, max_bytes=None)
    assert not (tmp_path / "scratch").exists()
    assert store.get(whole) == b"whole" and store.get_product("aa1") is not None
    assert store.get(orphan) is None and store.get(left) is None and store.get_product("bb2") is None
    assert not list(tmp_path.rglob("*.part-*")) and not (tmp_path / "products" / "cc" / "cc3").exists()
    assert not (tmp_path / "bakes" / "dd4").exists()
    assert (done.dropped, done.kept_bytes) == (5, size_of(store))
    assert done.freed_bytes == before - size_of(store) - len(b"of a killed writer")


def test_what_was_not_used_for_that_long_goes_with_its_files(tmp_path: Path) -> None:
    store = Store(tmp_path)
    old, shared = keep(store, "aa1", b"old", b"shared", used_s=NOW_S - 101.0)
    (new, _) = keep(store, "bb2", b"new", b"shared", used_s=NOW_S - 99.0)
    record(store, "island", [old], NOW_S - 101.0)
    done = clean(store, now_s=NOW_S, older_than_s=100.0, max_bytes=10_000)
    assert store.get_product("aa1") is None and store.get(old) is None
    assert store.get(new) == b"new" and store.get(shared) == b"shared"
    assert (done.dropped, done.kept_bytes) == (3, size_of(store)), "each counts once"


def test_a_bake_with_nothing_to_do_keeps_its_products_young(tmp_path: Path) -> None:
    store = Store(tmp_path)
    used = keep(store, "aa1", b"used", used_s=0.0)
    keep(store, "bb2", b"unused", used_s=0.0)
    record(store, "island", used, NOW_S - 5.0)
    clean(store, now_s=NOW_S, older_than_s=10.0, max_bytes=None)
    assert store.get_product("aa1") is not None and store.get_product("bb2") is None
    assert store.get_bake("island") is not None


def test_recalling_a_product_counts_as_use(tmp_path: Path) -> None:
    store = Store(tmp_path)
    keep(store, "aa1", b"x", used_s=0.0)
    store.get_product("aa1")
    assert (tmp_path / "products" / "aa" / "aa1").stat().st_mtime > NOW_S


def test_the_latest_of_all_uses_counts(tmp_path: Path) -> None:
    """Whichever of two bakes that name a product's file is the younger."""
    for name, used in (("up", (NOW_S - 50.0, NOW_S - 5.0)), ("down", (NOW_S - 5.0, NOW_S - 50.0))):
        store = Store(tmp_path / name)
        hashes = keep(store, "aa1", b"used", used_s=0.0)
        for bake, used_s in zip(("island", "other"), used, strict=True):
            record(store, bake, hashes, used_s)
        clean(store, now_s=NOW_S, older_than_s=10.0, max_bytes=None)
        assert store.get_product("aa1") is not None, name


def test_a_store_of_just_that_size_stays_and_files_that_products_share_count_once(tmp_path: Path) -> None:
    store = Store(tmp_path)
    keep(store, "aa1", b"own" * 50, b"shared" * 50, used_s=1.0)
    (_, shared) = keep(store, "bb2", b"new" * 50, b"shared" * 50, used_s=2.0)
    whole = size_of(store)
    assert clean(store, now_s=NOW_S, older_than_s=None, max_bytes=whole).dropped == 0
    done = clean(store, now_s=NOW_S, older_than_s=None, max_bytes=whole - 1)
    assert store.get_product("aa1") is None and store.get_product("bb2") is not None
    assert store.get(shared) is not None and done.kept_bytes == size_of(store)


@pytest.mark.parametrize("limit", [0, 250, 450, 10_000])
def test_the_store_is_cut_to_a_size_from_the_longest_unused(tmp_path: Path, limit: int) -> None:
    store = Store(tmp_path)
    for i in range(4):
        keep(store, f"{i}{i}k", bytes([i]) * 100, used_s=float(i))
    whole = size_of(store)
    done = clean(store, now_s=NOW_S, older_than_s=None, max_bytes=limit)
    stay = [i for i in range(4) if store.get_product(f"{i}{i}k") is not None]
    assert stay == list(range(4 - len(stay), 4))
    assert size_of(store) == done.kept_bytes <= limit
    if stay != [0, 1, 2, 3]:
        assert done.kept_bytes + whole // 4 > limit  # none goes without need
    assert done.freed_bytes == whole - done.kept_bytes


def test_a_missing_store_is_clean(tmp_path: Path) -> None:
    done = clean(Store(tmp_path / "none"), now_s=NOW_S, older_than_s=0.0, max_bytes=0)
    assert (done.dropped, done.freed_bytes, done.kept_bytes) == (0, 0, 0)
    assert not (tmp_path / "none").exists()


def test_it_waits_for_a_bake_that_uses_the_store(tmp_path: Path) -> None:
    store = Store(tmp_path)
    keep(store, "aa1", b"in use", used_s=0.0)
    with store.in_use(), store.in_use():  # two bakes at once do not wait for each other
        with (tmp_path / "locks" / "use").open("ab") as stream, pytest.raises(BlockingIOError):
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        cleaner = threading.Thread(
            target=clean, args=(store,), kwargs={"now_s": NOW_S, "older_than_s": 1.0, "max_bytes": 0}
        )
        cleaner.start()
        cleaner.join(0.3)
        assert cleaner.is_alive() and (tmp_path / "products" / "aa" / "aa1").exists()
    cleaner.join(30.0)
    assert not (tmp_path / "products" / "aa" / "aa1").exists()
