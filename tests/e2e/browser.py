"""A headless Chromium without a network of its own: pages come from a server inside this process.

It is driven through a pipe by the Chrome DevTools Protocol (https://chromedevtools.github.io/devtools-protocol),
so that no port is opened for it and no further package is needed.
"""

from __future__ import annotations

import fcntl
import json
import os
import select
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, unquote, urlsplit

from tests.processes import end, start

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless",
    "--remote-debugging-pipe",
    "--use-angle=swiftshader",  # WebGL 2 in software, the same on every machine
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # nobody is asked for anything
    "--log-level=3",
)
PATIENCE_S = 60
TYPES = {
    ".html": "text/html",
    ".js": "text/javascript",
    ".mjs": "text/javascript",
    ".wasm": "application/wasm",
}


def find_browser() -> str | None:
    """A Chromium or Chrome that is not a snap (a snap reads no temporary folders), or None."""
    for name in NAMES:
        path = shutil.which(name)
        if path and "/snap/" not in os.path.realpath(path):
            head = Path(path).read_bytes()[:4096]
            if not (head.startswith(b"#!") and b"snap" in head):
                return path
    return None


@contextmanager
def serve(folders: dict[str, Path], posted: Callable[[dict[str, str], bytes], None]) -> Iterator[str]:
    """Serves `folders` (first part of the path -> folder) on 127.0.0.1; what a page posts goes to `posted`,
    with the query. Gives the address."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            room, _, rest = unquote(urlsplit(self.path).path).lstrip("/").partition("/")
            file = folders[room] / rest if room in folders else None
            if file is None or not file.is_file():
                self.send_error(404)
                return
            data = file.read_bytes()
            self.send_response(200)
            self.send_header("Content-Type", TYPES.get(file.suffix, "application/octet-stream"))
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            posted(dict(parse_qsl(urlsplit(self.path).query)), body)
            self.send_response(204)
            self.end_headers()

        def log_message(self, *arguments: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


class Browser:
    """One page. `complaints` holds every error and warning of the console and every uncaught exception."""

    def __init__(self, program: str, profile: Path) -> None:
        self._rest = b""
        self._count = 0
        self._session: str | None = None
        self.complaints: list[str] = []
        # Root has no sandbox, nor has anybody in some containers: our own pages are shown without.
        for flags in ([], ["--no-sandbox"]) if os.geteuid() else (["--no-sandbox"],):
            self._start(program, [*FLAGS, *flags, f"--user-data-dir={profile}"])
            try:
                target = self.call("Target.createTarget", url="about:blank")["targetId"]
                break
            except (OSError, EOFError):
                self._end()
        else:
            raise EOFError(f"{program} does not start")
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Page"):
            self.call(f"{domain}.enable")

    def _start(self, program: str, flags: list[str]) -> None:
        to_browser, self._write = os.pipe()
        self._read, from_browser = os.pipe()
        # The protocol is spoken over 3 and 4; the shell puts the pipes there, wherever they were.
        pipes = [fcntl.fcntl(pipe, fcntl.F_DUPFD, 10) for pipe in (to_browser, from_browser)]
        os.close(to_browser)
        os.close(from_browser)
        shell = f'exec "$0" "$@" 3<&{pipes[0]} 4>&{pipes[1]}'
        command = ["bash", "-c", shell, program, *flags, "about:blank"]
        self._process = start(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, pass_fds=pipes)
        for pipe in pipes:
            os.close(pipe)

    def close(self) -> None:
        """Ends the browser."""
        self._session = None
        with suppress(OSError, EOFError):
            self.call("Browser.close")
        self._end()

    def _end(self) -> None:
        os.close(self._write)
        os.close(self._read)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=10)
        end(self._process)

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            if not select.select([self._read], [], [], PATIENCE_S)[0]:
                raise TimeoutError(f"the browser says nothing for {PATIENCE_S} s")
            more = os.read(self._read, 1 << 16)
            if not more:
                raise EOFError("the browser has gone")
            self._rest += more
        line, _, self._rest = self._rest.partition(b"\0")
        message: dict[str, Any] = json.loads(line)
        return message

    def _note(self, message: dict[str, Any]) -> None:
        result = message.get("params", {})
        if message.get("method") == "Runtime.consoleAPICalled" and result["type"] in (
            "error",
            "warning",
            "assert",
        ):
            parts = [str(part.get("value", part.get("description"))) for part in result["args"]]
            self.complaints.append(" ".join(parts))
        elif message.get("method") == "Runtime.exceptionThrown":
            details = result["exceptionDetails"]
            self.complaints.append(details.get("exception", {}).get("description", details["text"]))
        elif message.get("method") == "Log.entryAdded" and result["entry"]["level"] in ("error", "warning"):
            self.complaints.append(result["entry"]["text"])

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Calls a method of the protocol; its result. Raises RuntimeError with what the browser answers."""
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                result: dict[str, Any] = answer["result"]
                return result
            self._note(answer)

    def open(self, address: str) -> None:
        """Goes there; returns when the page has loaded."""
        self.call("Page.navigate", url=address)
        self.run(
            "new Promise((go) => document.readyState === 'complete' ? go() : addEventListener('load', go))"
        )

    def run(self, expression: str) -> Any:
        """The value of a JavaScript expression, awaited. Raises RuntimeError where it throws."""
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return answer["result"].get("value")
