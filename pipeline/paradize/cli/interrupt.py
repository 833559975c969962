"""Ctrl-C and SIGTERM: a command ends with one line, whatever it is at, and never with a traceback.

The first signal of a running command raises KeyboardInterrupt, so that it takes away what is half made. Any
other ends the process at once: one before the command runs or after it, a second one, one that lands where
Python drops exceptions.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from collections.abc import Callable

WHAT = "interrupted; nothing half-written stays"
AT_ONCE = "ended at once; files that were being written aside may stay"
EXIT_CODE = 130  # as shells tell it: 128 + SIGINT
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_PATIENCE_S = 10  # so long the command may take to end in good order

_came = False


def _leave(*_: object) -> NoReturn:
    """Says so and ends the process: no `finally` runs any more. While a command runs, it may leave files that
    it was writing aside, and have begun its JSON object."""
    if "--json" in sys.argv and not _came:
        _write(1, f'{{"error": ["{WHAT}"]}}\n')
    _write(2, f"paradize: {AT_ONCE if _came else WHAT}\n")
    os._exit(EXIT_CODE)


def _write(stream: int, text: str) -> None:
    with suppress(OSError):  # nobody may be reading
        os.write(stream, text.encode())


def _raise(*_: object) -> NoReturn:
    global _came
    _came = True
    _handle(_leave)
    signal.signal(signal.SIGALRM, _leave)
    signal.alarm(_PATIENCE_S)
    raise KeyboardInterrupt


def interrupted() -> bool:
    """Whether a signal came since `interruptible` began. An error that follows is none: libraries make others
    of KeyboardInterrupt."""
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
    """From here on signals are too late: all is done, and the process ends by itself."""
    _handle(signal.SIG_IGN)


def interruptible(call: Callable[[], int]) -> int:
    """What `call` returns. A signal raises KeyboardInterrupt in it."""
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
