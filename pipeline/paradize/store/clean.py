"""Limits the size of the store: drops files that no entry names, then entries that are too old or too many.

A bake holds the store's lock shared, `clean` holds it alone: it waits until no bake uses the store. A product
counts as used when its entry was written or read, and when a later bake that had nothing to do still names
one of its files.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from paradize.errors import BakeError
from paradize.store.atomic import remove_partial
from paradize.store.local import Store, hashes_in


@dataclass(frozen=True)
class CleanResult:
    """dropped: number of entries dropped (products, blobs, records). freed_bytes and kept_bytes."""

    dropped: int
    freed_bytes: int
    kept_bytes: int


@dataclass
class _Entry:
    path: Path
    size: int
    used_s: float
    blobs: set[str] = field(default_factory=set)


def clean(store: Store, *, now_s: float, older_than_s: float | None, max_bytes: int | None) -> CleanResult:
    """Drops damaged entries, products without their files, and files that no product names. Then drops
    entries that were not used within older_than_s seconds before now_s. Then drops those unused for longest
    until the store holds at most max_bytes. None: no limit. Waits for bakes that use the store.

    Raises BakeError where the file system refuses.
    """
    if not store.root.is_dir():
        return CleanResult(0, 0, 0)
    with store.alone():
        try:
            return _clean(store, now_s, older_than_s, max_bytes)
        except OSError as error:
            mend = "let this user write there, or set PARADIZE_STORE to another folder"
            raise BakeError(
                f"cannot be cleaned: {error.strerror or error}", file=store.root, mend=mend
            ) from None


def _clean(store: Store, now_s: float, older_than_s: float | None, max_bytes: int | None) -> CleanResult:
    root = store.root
    for folder in [root / "bakes", *_folders(root / "blobs"), *_folders(root / "products")]:
        remove_partial(folder)
    shutil.rmtree(root / "scratch", ignore_errors=True)  # scratch folders of killed bakes: none runs now
    shutil.rmtree(root / "remotes", ignore_errors=True)  # a cache
    blobs = {path.name: path.stat().st_size for path in _files(root / "blobs")}
    records, bad_records = _entries(root / "bakes")
    products, bad_products = _entries(root / "products")
    dropped = bad_records + bad_products
    last_use: dict[str, float] = {}
    for record in records:
        for sha256 in record.blobs:
            last_use[sha256] = max(record.used_s, last_use.get(sha256, 0.0))
    products_kept: list[_Entry] = []
    for product in products:
        product.used_s = max([product.used_s, *(last_use.get(sha256, 0.0) for sha256 in product.blobs)])
        (products_kept if product.blobs <= blobs.keys() else dropped).append(product)
    if older_than_s is not None:
        oldest = now_s - older_than_s
        dropped += [entry for entry in [*products_kept, *records] if entry.used_s < oldest]
        products_kept = [entry for entry in products_kept if entry.used_s >= oldest]
        records = [entry for entry in records if entry.used_s >= oldest]
    uses = Counter(sha256 for product in products_kept for sha256 in product.blobs)
    size = sum(entry.size for entry in [*products_kept, *records]) + sum(blobs[sha256] for sha256 in uses)
    if max_bytes is not None:
        for entry in sorted([*products_kept, *records], key=lambda entry: (entry.used_s, entry.path.name)):
            if size <= max_bytes:
                break
            dropped.append(entry)
            size -= entry.size
            if entry in records:
                continue
            for sha256 in entry.blobs:
                uses[sha256] -= 1
                if not uses[sha256]:
                    size -= blobs[sha256]
    freed = 0
    for entry in dropped:  # before their blobs: after a kill orphans remain, which the next `clean` drops
        entry.path.unlink(missing_ok=True)
        freed += entry.size
    orphans = [sha256 for sha256 in blobs if not uses[sha256]]
    for sha256 in orphans:
        (root / "blobs" / sha256[:2] / sha256).unlink(missing_ok=True)
        freed += blobs[sha256]
    return CleanResult(len(dropped) + len(orphans), freed, size)


def _folders(top: Path) -> list[Path]:
    return sorted(path for path in top.iterdir() if path.is_dir()) if top.is_dir() else []


def _files(top: Path) -> Iterator[Path]:
    for folder in _folders(top):
        yield from sorted(path for path in folder.iterdir() if path.is_file())


def _entries(top: Path) -> tuple[list[_Entry], list[_Entry]]:
    """The JSON entries under `top`: the readable and the damaged ones."""
    good: list[_Entry] = []
    bad: list[_Entry] = []
    top_files = sorted(path for path in top.iterdir() if path.is_file()) if top.is_dir() else []
    for path in [*top_files, *_files(top)]:
        status = path.stat()
        entry = _Entry(path, status.st_size, status.st_mtime)
        tree = Store.read_entry(path)
        entry.blobs = set(hashes_in(tree))
        (bad if tree is None else good).append(entry)
    return good, bad
