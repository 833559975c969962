"""The worker's side: waits for calls on a socket, runs them, sends back a value or an error."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
from multiprocessing.connection import Connection

from paradize.errors import BakeError, ParadizeError, SourceError

_PR_SET_PDEATHSIG = 1  # Linux, sys/prctl.h


def _die_with_parent() -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() == 1:
            os._exit(1)


def serve(descriptor: int) -> None:
    """Serves calls on the socket until it closes. An interrupt is the parent's business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _die_with_parent()
    link = Connection(descriptor)
    while True:
        try:
            call, arguments = link.recv()
        except (EOFError, ConnectionError):
            return
        except Exception as broken:  # the module of the call cannot be imported
            link.send((None, BakeError(f"{type(broken).__name__}: {broken}{_where(broken)}")))
            continue
        value, error = None, None
        try:
            value = call(**arguments)
        except ParadizeError as known:
            error = known
        except MemoryError:
            error = SourceError("needs more memory than there is", mend="bake a smaller input")
        except RecursionError:
            error = SourceError("is nested too deeply")
        except Exception as unknown:
            error = BakeError(f"unforeseen {type(unknown).__name__}: {unknown}{_where(unknown)}")
        if sys.stdout is not None:
            with contextlib.suppress(OSError):  # what a library printed is no part of the answer
                sys.stdout.flush()
        try:
            link.send((value, error))
        except (BrokenPipeError, ConnectionError):
            return


def _where(error: BaseException) -> str:
    trace = error.__traceback__
    while trace and trace.tb_next:
        trace = trace.tb_next
    if not trace:
        return ""
    code = trace.tb_frame.f_code
    return f" (in {os.path.basename(code.co_filename)}, {code.co_name}, line {trace.tb_lineno})"  # noqa: PTH119
