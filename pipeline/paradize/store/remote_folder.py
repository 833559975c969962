"""A folder elsewhere, by URL: read, written whole, asked for sizes. fsspec speaks the protocols.

Each thread opens it anew: not every file system of fsspec is made for several at once.
"""

from __future__ import annotations

import errno
import hashlib
import re
import secrets
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from paradize.errors import BakeError, one_line
from paradize.files import NotAFileError, read_file, read_parts
from paradize.store.atomic import ASIDE

TIMEOUT_S = 15.0  # to connect, and without a sign of life
_URL = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://(.+)", re.S)
_SHELL = ("sftp", "ssh")
_HERE = ("file", "local")
_WHOLE = ("abfs", "adl", "az", "gcs", "gs", "oci", "oss", "s3", "s3a", "tos")  # an object appears whole
_EXTRAS = {"s3": "s3fs", "s3a": "s3fs", "gs": "gcsfs", "gcs": "gcsfs", "az": "adlfs", "abfs": "adlfs"}
_MEND = "name a folder, or a URL like sftp://host/folder or s3://bucket/folder"


def shown(url: str) -> str:
    """A URL as it may be told: without password and query."""
    found = _URL.fullmatch(url)
    if not found:
        return one_line(url)
    host, slash, path = re.split(r"[?#]", found[2])[0].partition("/")
    user, at, host = host.rpartition("@")
    return one_line(f"{found[1]}://{user.partition(':')[0]}{at}{host}{slash}{path}")


def shared_id(url: str) -> str:
    """Tells shared stores apart, and tells no password."""
    return hashlib.sha256(shown(url).encode()).hexdigest()[:32]


class RemoteFolder:
    """The folder at a URL, or at a path; nothing is asked of it before it is used. Raises BakeError where
    that is no URL, or one of an unknown protocol, or of one that needs a package that is not installed."""

    def __init__(self, url: str) -> None:
        self.shown = shown(url)
        found = _URL.fullmatch(url)
        if not found and (not url.strip() or re.match(r"[A-Za-z0-9+._@-]{2,}:", url)):
            raise self._refused("is neither a folder nor a URL")
        self.protocol = found[1].lower() if found else "file"
        self._url = url if found else str(Path(url).absolute())
        self._secrets: list[str] = []
        self._host: dict[str, Any] = {}
        if found and self.protocol in _HERE and not found[2].startswith("/"):
            raise self._refused("is no folder's whole path", f"write {self.protocol}:///folder")
        if found and self.protocol not in (*_HERE, "memory"):
            self._read_host(url)
        self._look_up()
        self._own = threading.local()
        self._opening = threading.Lock()
        self._failure: Exception | None = None

    def _refused(self, what: str, mend: str = _MEND) -> BakeError:
        return BakeError(what, file=f"--store {self.shown}", mend=mend)

    def _read_host(self, url: str) -> None:
        try:
            parts = urlsplit(url)
            port = parts.port
        except ValueError:
            raise self._refused("has no such port, or is no URL") from None
        if parts.password:
            self._secrets = [parts.password, unquote(parts.password)]
        if not parts.hostname:
            raise self._refused("names no host")
        if self.protocol in _SHELL:
            if not parts.path.strip("/"):
                raise self._refused("names no folder on the host", "write sftp://host/folder")
            given = {"username": parts.username, "password": parts.password}
            self._host = {key: unquote(value) for key, value in given.items() if value}
            self._host |= {"host": parts.hostname} | ({"port": port} if port else {})
            self._url = unquote(parts.path)

    def _look_up(self) -> None:
        """Finds the protocol's file system."""
        import fsspec

        try:
            fsspec.get_filesystem_class("file" if self.protocol in _SHELL else self.protocol)
        except ImportError as missing:
            package = _EXTRAS.get(self.protocol)
            mend = f"pip install {package}" if package else "install what it needs"
            what = f"{self.protocol}:// needs a package that is not installed: {missing}"
            raise self._refused(what, mend) from None
        except ValueError:
            raise self._refused(f"{self.protocol}:// is no known protocol") from None

    def _open(self) -> tuple[Any, str]:
        """A new file system, and the folder's path in it."""
        if self.protocol in _SHELL:
            from sshfs import SSHFileSystem

            limits = {"connect_timeout": TIMEOUT_S, "login_timeout": TIMEOUT_S}
            limits |= {"keepalive_interval": TIMEOUT_S / 3.0, "keepalive_count_max": 3}
            # known_hosts: as ssh has them; to sshfs any host is the right one unless it is told
            system = SSHFileSystem(**self._host, **limits, known_hosts=(), skip_instance_cache=True)
            return system, self._url
        from fsspec.core import url_to_fs

        options: dict[str, Any] = {"timeout": TIMEOUT_S} if self.protocol == "ftp" else {}
        if self.protocol in ("s3", "s3a"):
            limits = {"connect_timeout": TIMEOUT_S, "read_timeout": TIMEOUT_S}
            options = {"config_kwargs": limits | {"retries": {"max_attempts": 2}}}
        found: tuple[Any, str] = url_to_fs(self._url, skip_instance_cache=True, **options)
        return found

    def _mine(self) -> tuple[Any, str]:
        """This thread's file system, and the folder's path in it. One thread connects at a time; where it
        cannot, the others do not try."""
        if not hasattr(self._own, "opened"):
            with self._opening:
                if self._failure:
                    raise self._failure
                try:
                    system, root = self._open()
                except Exception as failure:
                    self._failure = failure
                    raise
            self._own.opened, self._own.made = (system, root.rstrip("/")), set()
        opened: tuple[Any, str] = self._own.opened
        return opened

    def forget(self) -> None:
        """Drops this thread's connection; the next call opens a new one."""
        self._own.__dict__.clear()

    def read(self, name: str) -> bytes:
        """The bytes of a file. Raises FileNotFoundError where there is none, and whatever else goes wrong."""
        system, root = self._mine()
        if self.protocol in _HERE:
            return read_file(f"{root}/{name}")
        self._require_file(system, f"{root}/{name}")
        data: bytes = system.cat_file(f"{root}/{name}")
        return data

    def fetch(self, name: str, path: Path) -> None:
        """Copies a file to a path here. Raises as `read`."""
        system, root = self._mine()
        if self.protocol in _HERE:
            with path.open("wb") as copy:
                copy.writelines(read_parts(f"{root}/{name}"))
            return
        self._require_file(system, f"{root}/{name}")
        system.get_file(f"{root}/{name}", str(path))

    def _require_file(self, system: Any, path: str) -> None:
        """Raises OSError where a pipe or the like would keep an SSH server, and so us, waiting. Raises
        FileNotFoundError where there is nothing."""
        if self.protocol in _SHELL and system.info(path)["type"] != "file":
            raise NotAFileError(errno.EINVAL, "is no regular file")

    def size(self, name: str) -> int | None:
        """A file's size in bytes; None where there is none. Raises what else goes wrong."""
        system, root = self._mine()
        try:
            return int(system.info(f"{root}/{name}")["size"])
        except FileNotFoundError:
            return None

    def write(self, name: str, data: bytes | Path) -> None:
        """Puts bytes, or a file's, there: aside first and renamed, unless files appear whole anyway. Makes
        missing folders. Raises whatever goes wrong."""
        system, root = self._mine()
        folder, _, base = f"{root}/{name}".rpartition("/")
        if self.protocol in _WHOLE:
            _copy(system, data, f"{folder}/{base}")
            return
        if folder not in self._own.made:
            _make(system, folder)
            self._own.made.add(folder)
        aside = f"{folder}/.{base}{ASIDE}{secrets.token_hex(4)}"
        try:
            _copy(system, data, aside)
            system.mv(aside, f"{folder}/{base}")
        except BaseException:
            with suppress(Exception):  # it may never have been there; what went wrong first counts
                system.rm_file(aside)
            raise

    def without_secrets(self, text: str) -> str:
        """The text on one line, without the URL's password."""
        for secret in self._secrets:
            text = text.replace(secret, "***")
        return one_line(text)


def _copy(system: Any, data: bytes | Path, path: str) -> None:
    if isinstance(data, Path):
        system.put_file(str(data), path)
    else:
        system.pipe_file(path, data)


def _make(system: Any, folder: str) -> None:
    """Makes a folder; twice where another makes it at the same time."""
    try:
        system.makedirs(folder, exist_ok=True)
    except OSError:
        system.makedirs(folder, exist_ok=True)
