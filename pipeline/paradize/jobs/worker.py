"""The worker's side: waits for calls on a socket, runs them, sends back a value or an error."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
from collections.abc import Mapping
from multiprocessing.connection import Connection

from paradize.errors import BakeError, ParadizeError, SourceError
from paradize.jobs.code import foreign_module
from paradize.jobs.limits import VARIABLE
from paradize.jobs.loader import expect

_PR_SET_PDEATHSIG = 1  # Linux, sys/prctl.h


class ForeignCode(BakeError):  # noqa: N818 (what was found)
    """This process runs other code than the task is keyed by. module: whose."""

    module = ""


def _die_with_parent(parent: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it was gone before
            os._exit(1)


def _limit_memory(most_bytes: int) -> None:
    """Lets this process allocate no more than that; no limit where it is 0."""
    if most_bytes and sys.platform == "linux":
        import resource

        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        wanted = most_bytes if hard == resource.RLIM_INFINITY else min(most_bytes, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (wanted, hard))


def _give_back() -> None:
    """Returns what the last call freed to the system, so that it is not counted as held (glibc)."""
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).malloc_trim(0)


def _require_code(code: Mapping[str, str]) -> None:
    """Raises ForeignCode where this process runs other code than the task is keyed by."""
    found = foreign_module(code)
    if found:
        error = ForeignCode(f"{found} is not the code that this bake began with", mend="bake again")
        error.module = found
        raise error


def serve(descriptor: int, parent: int, memory_bytes: int = 0) -> None:
    """Serves calls on the socket until it closes. An interrupt is the parent's business. parent: its process
    number. memory_bytes: what this process may allocate; 0: no limit."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _die_with_parent(parent)
    _limit_memory(memory_bytes)
    link = Connection(descriptor)
    while True:
        try:
            call, arguments, file, code = link.recv()
        except (EOFError, ConnectionError):
            return
        except Exception as broken:  # the module of the call cannot be imported
            link.send((None, BakeError(f"{type(broken).__name__}: {broken}{_where(broken)}")))
            continue
        value, error = None, None
        try:
            expect(code)
            _require_code(code)
            value = call(**arguments)
            _require_code(code)  # of what was loaded meanwhile
        except ParadizeError as known:
            value, error = None, known
        except MemoryError:
            mend = f"bake a smaller input, or set ${VARIABLE}"
            error = SourceError("needs more memory than there may be", file=file, mend=mend)
        except RecursionError:
            error = SourceError("is nested too deeply", file=file)
        except Exception as unknown:
            what = f"unforeseen {type(unknown).__name__}: {unknown}{_where(unknown)}"
            error = BakeError(what, file=file)
        if sys.stdout is not None:
            with contextlib.suppress(OSError):  # what a library printed is no part of the answer
                sys.stdout.flush()
        try:
            link.send((value, error))
        except (BrokenPipeError, ConnectionError):
            return
        except Exception as unsendable:
            link.send((None, BakeError(f"gave what cannot be sent: {unsendable}", file=file)))
        call = arguments = value = error = None
        _give_back()


def _where(error: BaseException) -> str:
    trace = error.__traceback__
    while trace and trace.tb_next:
        trace = trace.tb_next
    if not trace:
        return ""
    code = trace.tb_frame.f_code
    return f" (in {os.path.basename(code.co_filename)}, {code.co_name}, line {trace.tb_lineno})"  # noqa: PTH119
