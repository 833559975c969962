"""The worker's side: receives calls on a socket, runs them, sends back their steps and a value or
an error."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
from collections.abc import Mapping
from multiprocessing.connection import Connection

from paradize.errors import BakeError, ParadizeError, SourceError, unexpected
from paradize.jobs.code import foreign_module
from paradize.jobs.limits import VARIABLE
from paradize.jobs.loader import expect
from paradize.jobs.progress import listen

_PR_SET_PDEATHSIG = 1  # Linux, sys/prctl.h


class ForeignCode(BakeError):  # noqa: N818 (a finding, not a fault)
    """This process has loaded other code than the task's key was made with. module: the module that
    differs."""

    module = ""


def _die_with_parent(parent: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it ended before the call
            os._exit(1)


def _limit_memory(most_bytes: int) -> None:
    """Limits the allocations of this process; 0: no limit."""
    if most_bytes and sys.platform == "linux":
        import resource

        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        wanted = most_bytes if hard == resource.RLIM_INFINITY else min(most_bytes, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (wanted, hard))


def _trim_memory() -> None:
    """Returns freed memory to the system, so that it is not counted as used (glibc)."""
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).malloc_trim(0)


def _require_code(code: Mapping[str, str]) -> None:
    """Raises ForeignCode if this process has loaded other code than `code` names."""
    module = foreign_module(code)
    if module:
        error = ForeignCode(f"{module} is not the code that this bake began with", mend="bake again")
        error.module = module
        raise error


def serve(descriptor: int, parent: int, memory_bytes: int = 0) -> None:
    """Serves calls on the socket until it closes. SIGINT is ignored: the parent handles it. parent: its
    process number. memory_bytes: limit of this process's allocations; 0: none."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _die_with_parent(parent)
    _limit_memory(memory_bytes)
    connection = Connection(descriptor)
    listen(connection.send)
    while True:
        try:
            call, arguments, file, code = connection.recv()
        except (EOFError, ConnectionError):
            return
        except Exception as broken:  # the module of the call cannot be imported
            connection.send((None, BakeError(f"{type(broken).__name__}: {broken}{_where(broken)}")))
            continue
        value, error = None, None
        try:
            expect(code)
            _require_code(code)
            value = call(**arguments)
            _require_code(code)  # the call may have imported more modules
        except ParadizeError as known:
            value, error = None, known
        except MemoryError:
            mend = f"bake a smaller input, or set ${VARIABLE}"
            error = SourceError("needs more memory than the limit", file=file, mend=mend)
        except RecursionError:
            error = SourceError("is nested too deeply", file=file)
        except Exception as unknown:
            error = unexpected(unknown, _where(unknown), file)
        if sys.stdout is not None:
            with contextlib.suppress(OSError):  # output of a library is not part of the answer
                sys.stdout.flush()
        try:
            connection.send((value, error))
        except (BrokenPipeError, ConnectionError):
            return
        except Exception as unsendable:
            connection.send(
                (None, BakeError(f"returned a value that cannot be sent: {unsendable}", file=file))
            )
        call = arguments = value = error = None
        _trim_memory()


def _where(error: BaseException) -> str:
    trace = error.__traceback__
    while trace and trace.tb_next:
        trace = trace.tb_next
    if not trace:
        return ""
    code = trace.tb_frame.f_code
    return f" (in {os.path.basename(code.co_filename)}, {code.co_name}, line {trace.tb_lineno})"  # noqa: PTH119
