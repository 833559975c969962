"""Ctrl-C, SIGTERM and a closed terminal (SIGHUP): a command ends with one line and never with a traceback.

The first signal of a running command raises KeyboardInterrupt, so that the command removes unfinished files.
While a native module loads, it waits: libraries abort the process where Python's code fails there.
Any other signal ends the process at once: before or after the command, a second signal, or one that arrives
where Python drops exceptions."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from importlib.machinery import ExtensionFileLoader
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

WHAT = "interrupted; nothing half-written stays"
AT_ONCE = "ended at once; files that were being written aside may stay"
EXIT_CODE = 130  # as in shells: 128 + SIGINT
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_PATIENCE_S = 10  # the command may take this long to end cleanly
_AGAIN_S = 0.01  # a signal that has to wait is looked at again

_came = False


def _leave(*_: object) -> NoReturn:
    """Prints a line and ends the process without running any `finally`. A running command may leave temporary
    files and an unfinished JSON object."""
    if "--json" in sys.argv and not _came:
        _write(1, f'{{"error": ["{WHAT}"]}}\n')
    _write(2, f"paradize: {AT_ONCE if _came else WHAT}\n")
    os._exit(EXIT_CODE)


def _write(stream: int, text: str) -> None:
    with suppress(OSError):  # the stream may be closed
        os.write(stream, text.encode())


def _loads_native(frame: FrameType | None) -> bool:
    """Whether a native module is being loaded."""
    while frame is not None:
        if frame.f_code.co_name in ("create_module", "exec_module") and isinstance(
            frame.f_locals.get("self"), ExtensionFileLoader
        ):
            return True
        frame = frame.f_back
    return False


def _raise(_number: int, frame: FrameType | None) -> None:
    global _came
    if _loads_native(frame):
        signal.signal(signal.SIGALRM, _raise)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        return
    _came = True
    _handle(_leave)
    signal.signal(signal.SIGALRM, _leave)
    signal.alarm(_PATIENCE_S)
    raise KeyboardInterrupt


def interrupted() -> bool:
    """Whether a signal came since `interruptible` began. Then a later error does not count: libraries turn
    KeyboardInterrupt into other exceptions."""
    return _came


def _dropped(unraisable: Any) -> None:
    """Called where Python cannot raise: in a destructor, say."""
    if isinstance(unraisable.exc_value, KeyboardInterrupt):
        _leave()
    sys.__unraisablehook__(unraisable)


def _handle(how: Callable[..., Any] | signal.Handlers) -> None:
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # the parent process ignores it, as nohup does
            signal.signal(number, how)


def leave_at_once() -> None:
    """From here on a signal ends the process at once."""
    _handle(_leave)


def ignore() -> None:
    """From here on signals are ignored: the work is done, and the process is about to end."""
    _handle(signal.SIG_IGN)


def interruptible(call: Callable[[], int]) -> int:
    """Calls `call` and returns its result. A signal raises KeyboardInterrupt in it."""
    global _came
    before, hook = {number: signal.getsignal(number) for number in _SIGNALS}, sys.unraisablehook
    try:
        _came = False
        sys.unraisablehook = _dropped
        _handle(_raise)
        return call()
    finally:
        _handle(_leave)
        signal.alarm(0)
        sys.unraisablehook = hook
        for number, how in before.items():
            signal.signal(number, how)
