"""Simulates keyboard and mouse through libX11.

usage: press.py STEP... -- PLAYER ARGUMENT...

Starts the player, waits for its window and takes the steps in order:
  KEY        presses a key by its X name (w, Escape, Left)
  hold:KEY   presses it and releases it after a while
  mouse      moves the mouse across the window
  unfocus    presses w and, while it is down, gives the keyboard to no window
  size:WxH   makes the window this large
  minimise   makes the window an icon, as a window manager does
  restore    shows it again
  idle       fails if the player takes more than a tenth of the processor's time for a while
  save:FILE  writes the window's picture, as rows of BGRX
  still      waits until the window's picture stays the same
  moved      waits until the picture differs from the one of the last step `still` or `moved`
  end        waits until the player has ended with exit code 0
The exit code is 0 if every step succeeds.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from ctypes import POINTER, byref, c_char_p, c_int, c_long, c_uint, c_ulong, c_void_p
from pathlib import Path

PATIENCE_S = 120.0
HOLD_S = 0.6
KEY_PRESS, KEY_RELEASE = 2, 3
Z_PIXMAP = 2


class InputEvent(ctypes.Structure):
    """XKeyEvent, and XMotionEvent up to `keycode`."""

    _fields_ = (
        ("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", c_void_p),
        ("window", c_ulong), ("root", c_ulong), ("subwindow", c_ulong), ("time", c_ulong),
        ("x", c_int), ("y", c_int), ("x_root", c_int), ("y_root", c_int),
        ("state", c_uint), ("keycode", c_uint), ("same_screen", c_int), ("padding", c_long * 16),
    )  # fmt: skip


class ImageHead(ctypes.Structure):
    """The first members of XImage."""

    _fields_ = (
        ("width", c_int), ("height", c_int), ("xoffset", c_int), ("format", c_int), ("data", c_void_p),
        ("byte_order", c_int), ("bitmap_unit", c_int), ("bitmap_bit_order", c_int), ("bitmap_pad", c_int),
        ("depth", c_int), ("bytes_per_line", c_int),
    )  # fmt: skip


class Display:
    """The X server and one window on it."""

    def __init__(self) -> None:
        x = ctypes.CDLL("libX11.so.6")
        x.XOpenDisplay.restype = x.XGetImage.restype = c_void_p
        x.XDefaultRootWindow.restype = x.XStringToKeysym.restype = c_ulong
        x.XDefaultRootWindow.argtypes = [c_void_p]
        x.XStringToKeysym.argtypes = [c_char_p]
        x.XKeysymToKeycode.argtypes = [c_void_p, c_ulong]
        x.XKeysymToKeycode.restype = ctypes.c_ubyte
        x.XInternAtom.restype = c_ulong
        x.XInternAtom.argtypes = [c_void_p, c_char_p, c_int]
        x.XChangeProperty.argtypes = [c_void_p, c_ulong, c_ulong, c_ulong, c_int, c_int, c_void_p, c_int]
        for function in (x.XMapWindow, x.XUnmapWindow):
            function.argtypes = [c_void_p, c_ulong]
        x.XResizeWindow.argtypes = [c_void_p, c_ulong, c_uint, c_uint]
        x.XSetInputFocus.argtypes = [c_void_p, c_ulong, c_int, c_ulong]
        x.XFetchName.argtypes = [c_void_p, c_ulong, POINTER(c_char_p)]
        x.XSendEvent.argtypes = [c_void_p, c_ulong, c_int, c_long, c_void_p]
        x.XSync.argtypes = [c_void_p, c_int]
        x.XGetImage.argtypes = [c_void_p, c_ulong, c_int, c_int, c_uint, c_uint, c_ulong, c_int]
        x.XWarpPointer.argtypes = [c_void_p, c_ulong, c_ulong, c_int, c_int, c_uint, c_uint, c_int, c_int]
        x.XQueryTree.argtypes = [
            c_void_p,
            c_ulong,
            *[POINTER(c_ulong)] * 2,
            POINTER(POINTER(c_ulong)),
            c_void_p,
        ]
        x.XGetGeometry.argtypes = [
            c_void_p,
            c_ulong,
            POINTER(c_ulong),
            *[POINTER(c_int)] * 2,
            *[POINTER(c_uint)] * 4,
        ]
        self.x = x
        self.display = x.XOpenDisplay(None)
        if not self.display:
            sys.exit("no X display")
        self.root = x.XDefaultRootWindow(self.display)
        self.window = 0

    def windows(self) -> Iterator[int]:
        root, parent, count, children = c_ulong(), c_ulong(), c_uint(), POINTER(c_ulong)()
        self.x.XQueryTree(self.display, self.root, byref(root), byref(parent), byref(children), byref(count))
        for i in range(count.value):
            name = c_char_p()
            if self.x.XFetchName(self.display, children[i], byref(name)) and name.value:
                yield children[i]

    def send(self, kind: int, key: str = "") -> None:
        code = self.x.XKeysymToKeycode(self.display, self.x.XStringToKeysym(key.encode())) if key else 0
        event = InputEvent(
            type=kind, send_event=1, display=self.display, window=self.window, root=self.root,
            x=10, y=10, x_root=10, y_root=10, keycode=code, same_screen=1,
        )  # fmt: skip
        self.x.XSendEvent(self.display, self.window, 1, 0, byref(event))
        self.x.XSync(self.display, 0)

    def resize(self, width: int, height: int) -> None:
        self.x.XResizeWindow(self.display, self.window, width, height)
        self.x.XSync(self.display, 0)

    def show(self, *, shown: bool) -> None:
        """ICCCM 4.1.3.1: WM_STATE is 1 for a window that is shown, 3 for an icon."""
        kind = self.x.XInternAtom(self.display, b"WM_STATE", 0)
        state = (c_ulong * 2)(1 if shown else 3, 0)
        change = self.x.XMapWindow if shown else self.x.XUnmapWindow
        change(self.display, self.window)
        self.x.XChangeProperty(self.display, self.window, kind, kind, 32, 0, state, 2)
        self.x.XSync(self.display, 0)

    def focus(self, window: int) -> None:
        self.x.XSetInputFocus(self.display, window, 0, 0)
        self.x.XSync(self.display, 0)

    def move_mouse(self) -> None:
        for _ in range(4):
            self.x.XWarpPointer(self.display, 0, 0, 0, 0, 0, 0, 15, 5)
            self.x.XSync(self.display, 0)
            time.sleep(0.1)

    def picture(self) -> bytes:
        root, x, y = c_ulong(), c_int(), c_int()
        width, height, border, depth = (c_uint() for _ in range(4))
        self.x.XGetGeometry(
            self.display, self.window, byref(root), byref(x), byref(y),
            byref(width), byref(height), byref(border), byref(depth),
        )  # fmt: skip
        image = self.x.XGetImage(self.display, self.window, 0, 0, width, height, ~0 & 0xFFFFFFFF, Z_PIXMAP)
        head = ImageHead.from_address(image)
        return ctypes.string_at(head.data, head.bytes_per_line * head.height)


def processor_s(process: int) -> float:
    """The processor time of a process, seconds."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def take(step: str, display: Display, player: subprocess.Popen[bytes], seen: list[bytes]) -> None:
    if step == "end":
        if player.wait(PATIENCE_S) != 0:
            sys.exit(f"the player ended with {player.returncode}")
        return
    if player.poll() is not None:
        sys.exit(f"before step {step} the player ended with {player.returncode}")
    name, _, value = step.partition(":")
    if step == "mouse":
        display.move_mouse()
    elif step == "unfocus":
        display.focus(display.window)
        time.sleep(HOLD_S)
        display.send(KEY_PRESS, "w")
        time.sleep(HOLD_S)
        display.focus(0)
    elif name == "size":
        display.resize(*map(int, value.split("x")))
    elif name in ("minimise", "restore"):
        display.show(shown=name == "restore")
    elif step == "idle":
        time.sleep(HOLD_S)  # what was begun
        before_s, start_s = processor_s(player.pid), time.monotonic()
        time.sleep(4 * HOLD_S)
        share = (processor_s(player.pid) - before_s) / (time.monotonic() - start_s)
        if share > 0.1:
            sys.exit(f"the player takes {share:.0%} of a processor")
    elif name == "save":
        Path(value).write_bytes(display.picture())
    elif step in {"still", "moved"}:
        before, now = seen[-1] if seen else b"", display.picture()
        if step == "still":
            time.sleep(HOLD_S)
            before = display.picture()
            time.sleep(HOLD_S)
            now = display.picture()
        end_s = time.monotonic() + PATIENCE_S
        while step == "moved" and before == now and time.monotonic() < end_s:
            time.sleep(0.05)
            now = display.picture()
        seen.append(now)
        if (before == now) != (step == "still"):
            sys.exit(f"the picture is not {step}")
    else:
        key = step.removeprefix("hold:")
        display.send(KEY_PRESS, key)
        if key != step:
            time.sleep(HOLD_S)
            display.send(KEY_RELEASE, key)


def main() -> None:
    at = sys.argv.index("--")
    steps, command = sys.argv[1:at], sys.argv[at + 1 :]
    display = Display()
    with subprocess.Popen(command) as player:
        try:
            end = time.monotonic() + PATIENCE_S
            while not (found := list(display.windows())):
                if time.monotonic() > end or player.poll() is not None:
                    sys.exit("no window appeared")
                time.sleep(0.1)
            display.window = found[0]
            time.sleep(1.0)  # its first frames
            seen: list[bytes] = []
            for step in steps:
                take(step, display, player, seen)
        finally:
            player.kill()


if __name__ == "__main__":
    main()
