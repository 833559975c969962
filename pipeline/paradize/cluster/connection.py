"""The connection to a Dask scheduler. Its failures become one clear message; Dask's own log is silent."""

from __future__ import annotations

import logging
import platform
import queue
import threading
import warnings
from collections.abc import Callable
from typing import Any

from paradize.errors import BakeError, one_line

CONNECT_S = 10.0  # until a scheduler must have answered


class ClusterLost(BakeError):  # noqa: N818 (an event, not a fault)
    """There is no cluster, or it has gone. Jobs that have not finished are not run."""


def connect(address: str) -> Any:
    """Returns a Dask client. Raises ClusterLost if no scheduler answers or if its version differs, BakeError
    if `distributed` is not installed."""
    try:
        import distributed
    except ImportError:
        mend = "install it as of setup/python-test.txt, or with pip install 'paradize[cluster]'"
        raise BakeError("--cluster needs the library distributed (Dask)", mend=mend) from None
    for name in ("distributed", "distributed.client", "distributed.comm"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    mend = "start it with `dask scheduler`, or mend the address: tcp://HOST:PORT"
    client, why = _within(CONNECT_S, lambda: _client(address))
    if client is None:
        what = f"no Dask scheduler answers within {CONNECT_S:g} s{why}"
        raise ClusterLost(what, file=address, mend=mend)
    scheduler = client.get_versions()["scheduler"]["packages"]
    ours = {"python": platform.python_version(), "distributed": distributed.__version__}
    for name, version in ours.items():
        theirs = str(scheduler[name])
        same = theirs.split(".")[:2] == version.split(".")[:2] if name == "python" else theirs == version
        if not same:
            client.close()
            what = f"the scheduler runs {name} {theirs}, this bake {version}"
            raise ClusterLost(what, file=address, mend="install the same on both")
    return client


def _client(address: str) -> Any:
    import dask
    import distributed

    with warnings.catch_warnings(), dask.config.set({"distributed.comm.timeouts.connect": f"{CONNECT_S}s"}):
        warnings.simplefilter("ignore", distributed.versions.VersionMismatchWarning)
        return distributed.Client(address, timeout=CONNECT_S, set_as_default=False)


def _within(seconds: float, make: Callable[[], Any]) -> tuple[Any, str]:
    """Returns the result of `make` and ""; None and a reason if it raises or takes longer than `seconds`.
    Dask waits for ever for a host that accepts the connection and sends nothing."""
    answers: queue.SimpleQueue[tuple[Any, str]] = queue.SimpleQueue()

    def run() -> None:
        try:
            answers.put((make(), ""))
        except Exception as error:  # Dask raises many kinds
            reason = one_line(str(error)).strip().rstrip(".")[:200]
            answers.put((None, f" ({type(error).__name__}: {reason})"))

    threading.Thread(target=run, daemon=True).start()
    try:
        return answers.get(timeout=seconds + 1.0)
    except queue.Empty:
        return None, ""
