"""Keeps the store bounded: drops what nothing names, what has long not been used, what is too much.

A bake holds the store in common with other bakes, `clean` holds it alone: it waits until no bake uses it.
What a product was last used for is the latest of two times: when its entry was made or recalled, and when a
bake on record that names one of its files last had nothing to do.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from paradize.errors import BakeError
from paradize.store.atomic import sweep_aside
from paradize.store.local import Store, hashes_in


@dataclass(frozen=True)
class Cleaned:
    """What `clean` did: entries dropped (products, blobs, records), bytes freed and bytes that stay."""

    dropped: int
    freed_bytes: int
    kept_bytes: int


@dataclass
class _Entry:
    path: Path
    size: int
    used_s: float
    blobs: set[str] = field(default_factory=set)


def clean(store: Store, *, now_s: float, older_than_s: float | None, to_bytes: int | None) -> Cleaned:
    """Drops damaged entries, products that miss a file, files that no product names; then what was not used
    within older_than_s seconds before now_s; then what was used longest ago until the store holds at most
    to_bytes. None: no such limit. Waits for bakes that use the store.

    Raises BakeError when the store's folder refuses.
    """
    if not store.root.is_dir():
        return Cleaned(0, 0, 0)
    with store.alone():
        try:
            return _clean(store, now_s, older_than_s, to_bytes)
        except OSError as error:
            mend = "let this user write there, or set PARADIZE_STORE to another folder"
            raise BakeError(
                f"cannot be cleaned: {error.strerror or error}", file=store.root, mend=mend
            ) from None


def _clean(store: Store, now_s: float, older_than_s: float | None, to_bytes: int | None) -> Cleaned:
    root = store.root
    for folder in [root / "bakes", *_folders(root / "blobs"), *_folders(root / "products")]:
        sweep_aside(folder)
    shutil.rmtree(root / "rooms", ignore_errors=True)  # of killed bakes: none runs now
    shutil.rmtree(root / "remotes", ignore_errors=True)  # only saves looks
    blobs = {path.name: path.stat().st_size for path in _files(root / "blobs")}
    records, bad_records = _entries(root / "bakes")
    products, bad_products = _entries(root / "products")
    gone = bad_records + bad_products
    last_use: dict[str, float] = {}
    for record in records:
        for sha256 in record.blobs:
            last_use[sha256] = max(record.used_s, last_use.get(sha256, 0.0))
    kept: list[_Entry] = []
    for product in products:
        product.used_s = max([product.used_s, *(last_use.get(sha256, 0.0) for sha256 in product.blobs)])
        (kept if product.blobs <= blobs.keys() else gone).append(product)
    if older_than_s is not None:
        oldest = now_s - older_than_s
        gone += [entry for entry in [*kept, *records] if entry.used_s < oldest]
        kept = [entry for entry in kept if entry.used_s >= oldest]
        records = [entry for entry in records if entry.used_s >= oldest]
    named = Counter(sha256 for product in kept for sha256 in product.blobs)
    size = sum(entry.size for entry in [*kept, *records]) + sum(blobs[sha256] for sha256 in named)
    if to_bytes is not None:
        for entry in sorted([*kept, *records], key=lambda entry: (entry.used_s, entry.path.name)):
            if size <= to_bytes:
                break
            gone.append(entry)
            size -= entry.size
            if entry in records:
                continue
            for sha256 in entry.blobs:
                named[sha256] -= 1
                if not named[sha256]:
                    size -= blobs[sha256]
    freed = 0
    for entry in gone:  # before their blobs: what a kill leaves is an orphan, and goes next time
        entry.path.unlink(missing_ok=True)
        freed += entry.size
    orphans = [sha256 for sha256 in blobs if not named[sha256]]
    for sha256 in orphans:
        (root / "blobs" / sha256[:2] / sha256).unlink(missing_ok=True)
        freed += blobs[sha256]
    return Cleaned(len(gone) + len(orphans), freed, size)


def _folders(top: Path) -> list[Path]:
    return sorted(path for path in top.iterdir() if path.is_dir()) if top.is_dir() else []


def _files(top: Path) -> Iterator[Path]:
    for folder in _folders(top):
        yield from sorted(path for path in folder.iterdir() if path.is_file())


def _entries(top: Path) -> tuple[list[_Entry], list[_Entry]]:
    """The JSON entries under `top`, those that can be read and those that cannot."""
    good: list[_Entry] = []
    bad: list[_Entry] = []
    here = sorted(path for path in top.iterdir() if path.is_file()) if top.is_dir() else []
    for path in [*here, *_files(top)]:
        status = path.stat()
        entry = _Entry(path, status.st_size, status.st_mtime)
        tree = Store.read_entry(path)
        entry.blobs = set(hashes_in(tree))
        (bad if tree is None else good).append(entry)
    return good, bad
