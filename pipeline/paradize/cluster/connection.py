"""The line to a Dask scheduler: one clear message where there is none, and no word of Dask's own."""

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
HOWTO = "see pipeline/paradize/cluster/README.md"


class ClusterLost(BakeError):  # noqa: N818 (what happened)
    """There is no cluster, or no longer: what was not baked is not."""


def connect(address: str) -> Any:
    """A Dask client. Raises ClusterLost where no scheduler answers, or where it is not of our version."""
    try:
        import distributed
    except ImportError:
        mend = "install it as of setup/python-test.txt, or with pip install 'paradize[cluster]'"
        raise BakeError("--cluster needs the library distributed (Dask)", mend=mend) from None
    for name in ("distributed", "distributed.client", "distributed.comm"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    mend = f"start it with `dask scheduler`, or mend the address: tcp://HOST:PORT; {HOWTO}"
    client, why = _within(CONNECT_S, lambda: _client(address))
    if client is None:
        what = f"no Dask scheduler answers within {CONNECT_S:g} s{why}"
        raise ClusterLost(what, file=address, mend=mend)
    there = client.get_versions()["scheduler"]["packages"]
    here = {"python": platform.python_version(), "distributed": distributed.__version__}
    for name, version in here.items():
        found = str(there[name])
        same = found.split(".")[:2] == version.split(".")[:2] if name == "python" else found == version
        if not same:
            client.close()
            what = f"the scheduler runs {name} {found}, this bake {version}"
            raise ClusterLost(what, file=address, mend=f"install the same on both; {HOWTO}")
    return client


def _client(address: str) -> Any:
    import dask
    import distributed

    with warnings.catch_warnings(), dask.config.set({"distributed.comm.timeouts.connect": f"{CONNECT_S}s"}):
        warnings.simplefilter("ignore", distributed.versions.VersionMismatchWarning)
        return distributed.Client(address, timeout=CONNECT_S, set_as_default=False)


def _within(seconds: float, make: Callable[[], Any]) -> tuple[Any, str]:
    """What `make` gives; None, and why, where it raises or takes longer: Dask waits for ever for one that
    listens and says nothing."""
    given: queue.SimpleQueue[tuple[Any, str]] = queue.SimpleQueue()

    def run() -> None:
        try:
            given.put((make(), ""))
        except Exception as error:  # whatever answers there: Dask raises many kinds
            reason = one_line(str(error)).strip().rstrip(".")[:200]
            given.put((None, f" ({type(error).__name__}: {reason})"))

    threading.Thread(target=run, daemon=True).start()
    try:
        return given.get(timeout=seconds + 1.0)
    except queue.Empty:
        return None, ""
