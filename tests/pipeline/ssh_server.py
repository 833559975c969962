"""SSH servers on this machine for the tests of shared stores: asyncssh's, which can be told to fail, and
OpenSSH's where it is installed. Both listen on a free port of 127.0.0.1 with keys of their own.

Run as a program it is the first: see `main`.
"""

from __future__ import annotations

import argparse
import asyncio
import getpass
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import asyncssh
import pytest

from tests.processes import started

ROOT = Path(__file__).resolve().parents[2]
_MOUNTED = 'mount -t tmpfs -o mode=755 none /run && mkdir /run/sshd && exec "$@"'


class Home:
    """A user's home with an SSH key, and the key of the host that it knows. servers: this program, which
    serves its hosts."""

    def __init__(self, path: Path, servers: subprocess.Popen[str]) -> None:
        self.path, self.servers = path, servers
        (path / ".ssh").mkdir(parents=True)
        for name in ("id_ed25519", "host"):
            key = asyncssh.generate_private_key("ssh-ed25519")
            key.write_private_key(path / ".ssh" / name)
            key.write_public_key(path / ".ssh" / f"{name}.pub")
            (path / ".ssh" / name).chmod(0o600)
        self.host_key, self.user_key = path / ".ssh" / "host", path / ".ssh" / "id_ed25519.pub"

    def know(self, port: int, key: Path | None = None) -> None:
        """Has `ssh` know the host at the port by this key (default: the host's own)."""
        text = (key or self.host_key.with_suffix(".pub")).read_text()
        (self.path / ".ssh" / "known_hosts").write_text(f"[127.0.0.1]:{port} {text}")


@contextmanager
def asyncssh_server(home: Home, *options: str) -> Iterator[int]:
    """The port of a server of this program with these options."""
    assert home.servers.stdin is not None and home.servers.stdout is not None
    home.servers.stdin.write(json.dumps([str(home.host_key), str(home.user_key), *options]) + "\n")
    home.servers.stdin.flush()
    port, number = map(int, home.servers.stdout.readline().split())
    home.know(port)
    try:
        yield port
    finally:
        with suppress(ProcessLookupError):  # it may have died
            os.kill(number, signal.SIGKILL)


@contextmanager
def asyncssh_servers() -> Iterator[subprocess.Popen[str]]:
    """This program as it waits for servers to serve: to start it for each takes half a second."""
    command = [sys.executable, "-m", "tests.pipeline.ssh_server"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with started(command, **pipes, text=True, cwd=ROOT) as process:
        yield process


@contextmanager
def openssh_server(home: Home) -> Iterator[int]:
    """The port of an sshd; skips the test where there is none, or it may not be started."""
    program = shutil.which("sshd", path=f"{os.environ.get('PATH', '')}:/usr/sbin")
    if not program:
        pytest.skip("no sshd on this machine")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    config = home.path / "sshd_config"
    config.write_text(
        f"ListenAddress 127.0.0.1\nPort {port}\nHostKey {home.host_key}\nAuthorizedKeysFile {home.user_key}\n"
        "PidFile none\nStrictModes no\nUsePAM no\nPasswordAuthentication no\n"
        "KbdInteractiveAuthentication no\nSubsystem sftp internal-sftp\n"
    )
    command = [program, "-D", "-e", "-f", str(config)]
    if os.geteuid() == 0:  # it wants /run/sshd then: in a file system of its own
        command = ["unshare", "-m", "sh", "-c", _MOUNTED, "sh", *command]
    with started(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        said = process.stderr.readline()
        if "listening" not in said:
            pytest.skip(f"sshd does not start: {said.strip()}")
        home.know(port)
        yield port


def url_of(port: int, folder: Path) -> str:
    """The store in a folder, by the server at the port."""
    return f"sftp://{getpass.getuser()}@127.0.0.1:{port}{folder}"


class _Failing(asyncssh.SFTPServer):
    """Dies, falls silent or refuses to write, as the options have it."""

    options = argparse.Namespace(die=None, stop=None, read_only=False)
    opened = 0

    def open(self, path: bytes, pflags: int, attrs: asyncssh.SFTPAttrs) -> object:
        _Failing.opened += 1
        if self.opened == self.options.die:
            os._exit(1)
        if self.opened == self.options.stop:
            os.kill(os.getpid(), signal.SIGSTOP)
        if self.options.read_only and pflags & (asyncssh.FXF_WRITE | asyncssh.FXF_CREAT):
            raise asyncssh.SFTPPermissionDenied("this store is read only")
        return super().open(path, pflags, attrs)


async def _serve(options: argparse.Namespace) -> None:
    _Failing.options = options
    server = await asyncssh.listen(
        "127.0.0.1",
        0,
        server_host_keys=[str(options.host_key)],
        authorized_client_keys=str(options.user_key),
        sftp_factory=_Failing,
    )
    print(server.get_port(), os.getpid(), flush=True)
    await server.wait_closed()


def main() -> None:
    """Serves in a process of its own for each line of standard input, until that is killed: a list of the
    host's key, the user's key and options. --die N, --stop N: ends, or stops, as the Nth file is opened."""
    parser = argparse.ArgumentParser()
    parser.add_argument("host_key", type=Path)
    parser.add_argument("user_key", type=Path)
    parser.add_argument("--die", type=int)
    parser.add_argument("--stop", type=int)
    parser.add_argument("--read-only", action="store_true")
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for them
    for line in sys.stdin:
        if os.fork() == 0:
            asyncio.run(_serve(parser.parse_args(json.loads(line))))


if __name__ == "__main__":
    main()
