"""A store with another behind it that is shared: what others baked is fetched, what was baked is pushed.

The shared one holds blobs and products as `store.py` lays them out, and none of the rest. What comes from
there counts only when it is what its name or its seal says; blobs go there before the product that names
them. All of it runs beside the bake. Where the shared one cannot be reached, or written, that is a warning.
"""

from __future__ import annotations

import queue
import re
import secrets
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from paradize.files import NotAFileError
from paradize.store.atomic import ASIDE
from paradize.store.local import Store, hash_file, hashes_in, seal, unseal
from paradize.store.remote_folder import RemoteFolder, shared_id

_HANDS = 4  # connections: sshd begins to refuse at ten
_STALL_S = 600.0  # no file takes longer
_SHA256 = re.compile(r"[0-9a-f]{64}")
_SUFFIX = re.compile(r"[a-z0-9]*")

_Errand = tuple[Future[bool], Callable[[str], bool], str]


class SharedStore(Store):
    """A store here, at `root`, and the shared one at `url`; for one bake, between `in_use` and its end.

    Raises BakeError where the URL is none, see Place."""

    def __init__(self, root: Path, url: str) -> None:
        super().__init__(root)
        self._place = RemoteFolder(url)
        self._id = shared_id(url)
        known = self.read_entry(root / "remotes" / self._id)
        keys = known if isinstance(known, list) else []
        self._known = {key for key in keys if isinstance(key, str)}  # products that are there
        self._todo: queue.SimpleQueue[_Errand | None] = queue.SimpleQueue()
        self._hands: list[threading.Thread] = []
        self._coming: dict[str, Future[bool]] = {}  # products by key, blobs by SHA-256
        self._going: dict[str, Future[bool]] = {}  # products by key
        self._damaged: set[str] = set()  # names of files there
        self._away: str | None = None  # why it is asked for nothing any more
        self._shut: str | None = None  # why nothing is pushed any more

    @contextmanager
    def in_use(self) -> Iterator[None]:
        try:
            with super().in_use():
                yield
        finally:
            self._away = "the bake is over"
            for _ in self._hands:
                self._todo.put(None)

    def expect(self, keys: Iterable[str]) -> None:
        for key in keys:
            if not self._product(key).exists():
                self._fetch(self._fetch_product, key)

    def get_product(self, key: str) -> Any | None:
        product = None if key in self._coming else super().get_product(key)
        if product is not None and key not in self._known and key not in self._going:
            self._going[key] = self._later(self._share, key)
        if product is None and self._wait(self._fetch(self._fetch_product, key)):
            product = super().get_product(key)
        for sha256 in hashes_in(product):
            if not self._blob(sha256).exists():
                self._fetch(self._fetch_blob, sha256)
        return product

    def put_product(self, key: str, product: Any) -> None:
        super().put_product(key, product)
        self._coming.pop(key, None)
        self._going[key] = self._later(self._replace, key)

    def get(self, sha256: str) -> bytes | None:
        self._arrive(sha256)
        data = super().get(sha256)
        if data is None and self._wait(self._fetch(self._fetch_blob, sha256)):
            data = super().get(sha256)
        return data

    def find(self, sha256: str) -> Path | None:
        self._arrive(sha256)
        path = super().find(sha256)
        if path is None and self._wait(self._fetch(self._fetch_blob, sha256)):
            path = super().find(sha256)
        return path

    def _arrive(self, sha256: str) -> None:
        """Waits for a blob that is on its way."""
        if sha256 in self._coming:
            self._wait(self._coming[sha256])

    def settle(self) -> list[str]:
        done = [self._wait(future) for future in self._going.values()]
        if all(done) and not self._away:
            self.shared_as = self._id
        self._write(self.root / "remotes" / self._id, seal(sorted(self._known)))
        return self._warnings()

    def _warnings(self) -> list[str]:
        who, found = f"--store {self._place.shown}", []
        if self._damaged:
            some = ", ".join(sorted(self._damaged)[:3]) + (" ..." if len(self._damaged) > 3 else "")
            many = f"{len(self._damaged)} damaged file{'s' if len(self._damaged) > 1 else ''}"
            found.append(f"{who} holds {many}, baked anew: {some}")
        if self._away:
            found.append(f"{who} cannot be used, baked without it: {self._away}")
        elif self._shut:
            found.append(f"{who} takes nothing, so what was baked is not shared: {self._shut}")
        return found

    # Errands: what the hands do.

    def _fetch(self, call: Callable[[str], bool], name: str) -> Future[bool]:
        """Fetches a product or a blob, once."""
        if name not in self._coming:
            self._coming[name] = self._later(call, name)
        return self._coming[name]

    def _later(self, call: Callable[[str], bool], name: str) -> Future[bool]:
        if not self._hands:
            self._hands = [threading.Thread(target=self._work, daemon=True) for _ in range(_HANDS)]
            for hand in self._hands:
                hand.start()
        future: Future[bool] = Future()
        self._todo.put((future, call, name))
        return future

    def _work(self) -> None:
        while errand := self._todo.get():
            future, call, name = errand
            future.set_result(self._try(call, name))
        self._place.forget()

    def _try(self, call: Callable[[str], bool], name: str) -> bool:
        """Whether the errand was done; tried twice, over a new connection. What fails then is no longer
        tried at all."""
        fetches = call in (self._fetch_product, self._fetch_blob)
        for last in (False, True):
            if self._away or (self._shut and not fetches):
                return False
            try:
                return call(name)
            except Exception as failure:
                if not last and not isinstance(failure, PermissionError):
                    self._place.forget()
                    continue
                reason = self._place.without_secrets(str(failure) or type(failure).__name__)
                if fetches:
                    self._away = reason
                else:
                    self._shut = reason
        return False

    def _wait(self, future: Future[bool]) -> bool:
        """Whether the errand was done, once it was."""
        if self._away and not future.done():
            return False
        try:
            return future.result(timeout=_STALL_S)
        except TimeoutError:
            self._away = f"no file arrived within {_STALL_S:g} s"
            return False

    def _fetch_product(self, key: str) -> bool:
        name = _product_name(key)
        try:
            data = self._place.read(name)
        except FileNotFoundError:
            return False
        except NotAFileError:
            data = b""
        if not _is_sound(unseal(data)):
            self._damaged.add(name)
            return False
        self._write(self._product(key), data)
        self._known.add(key)
        return True

    def _fetch_blob(self, sha256: str) -> bool:
        name, path = _blob_name(sha256), self._blob(sha256)
        path.parent.mkdir(parents=True, exist_ok=True)
        aside = path.with_name(f".{sha256}{ASIDE}{secrets.token_hex(4)}")
        try:
            self._place.fetch(name, aside)
            if hash_file(aside) != sha256:
                self._damaged.add(name)
                return False
            aside.replace(path)
        except FileNotFoundError:
            return False
        except NotAFileError:
            self._damaged.add(name)
            return False
        finally:
            aside.unlink(missing_ok=True)
        self.fetched.add(sha256)
        return True

    def _share(self, key: str) -> bool:
        """Pushes a product unless it is there."""
        if self._place.size(_product_name(key)):
            self._known.add(key)
            return True
        return self._replace(key)

    def _replace(self, key: str) -> bool:
        """Pushes the blobs that are not there, then the product."""
        product = self.read_entry(self._product(key))
        for sha256 in set(hashes_in(product)):
            name, path = _blob_name(sha256), super().find(sha256)
            if path is None:
                return False  # lost here, too: the bake makes it anew, and comes again
            if name in self._damaged or self._place.size(name) != path.stat().st_size:
                self._place.write(name, path)
                self.pushed.add(sha256)
        self._place.write(_product_name(key), seal(product))
        self._known.add(key)
        return True


def _blob_name(sha256: str) -> str:
    return f"blobs/{sha256[:2]}/{sha256}"


def _product_name(key: str) -> str:
    return f"products/{key[:2]}/{key}"


def _is_sound(product: Any) -> bool:
    """Whether what came can be a product: what becomes part of a file's name is what it should be."""
    if not isinstance(product, dict) or not all(map(_SHA256.fullmatch, hashes_in(product))):
        return False
    files = [one for one in product.values() if isinstance(one, dict) and "suffix" in one]
    return all(_SUFFIX.fullmatch(str(one["suffix"])) for one in files)
