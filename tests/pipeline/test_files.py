"""The functions that open files give regular files of bounded size, and answers at once whatever stands
there."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from paradize.errors import SourceError
from paradize.files import library_path, open_file, open_lock, read_file, read_parts, resolved
from paradize.formats.png import decode_png, encode_png
from paradize.readers.image import read_image
from paradize.readers.obj import read_obj
from tests.pipeline.scenes import ball
from tests.pipeline.strange_files import KINDS, MANY, SAID, pipe, spoil


def parts(path: Path) -> bytes:
    return b"".join(read_parts(path))


def opened(path: Path) -> bytes:
    with open_file(path) as stream:
        return stream.read()


def named(path: Path) -> bytes:
    with library_path(path) as name:
        return Path(name).read_bytes()


READERS: list[Callable[[Path], bytes]] = [read_file, parts, opened, named]


@pytest.mark.parametrize("read", READERS)
@pytest.mark.parametrize("kind", MANY)
def test_what_is_no_file_is_refused_in_words(
    kind: str, read: Callable[[Path], bytes], tmp_path: Path
) -> None:
    KINDS[kind](tmp_path / "a")
    with pytest.raises(OSError) as caught:
        read(tmp_path / "a")
    assert caught.value.strerror == SAID[kind]


@pytest.mark.parametrize("read", READERS)
def test_what_takes_a_files_place_after_a_look_is_not_opened(
    read: Callable[[Path], bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pipe that is renamed into place between the look and the opening: nothing waits for its writer."""
    path, real = tmp_path / "a", os.open
    path.write_bytes(b"file")

    def replaced(name: Any, *how: Any) -> int:
        if name == path:
            spoil(path, "pipe")
        return real(name, *how)

    monkeypatch.setattr(os, "open", replaced)
    with pytest.raises(OSError, match="is not a regular file"):
        read(path)


@pytest.mark.parametrize("read", READERS)
@pytest.mark.parametrize("content", [b"", b"x", bytes(range(256)) * 10_000])
def test_all_ways_of_reading_give_a_files_bytes(
    read: Callable[[Path], bytes], content: bytes, tmp_path: Path
) -> None:
    (tmp_path / "a").write_bytes(content)
    assert read(tmp_path / "a") == content


@pytest.mark.parametrize("read", [read_file, parts])
def test_a_file_that_grows_or_shrinks_while_it_is_read_is_no_endless_work(
    read: Callable[[Path], bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, real = tmp_path / "a", os.fstat
    part = bytes(1 << 20)  # as much as is read at once
    for before, now in ((b"short", b"longer by far"), (b"longer by far", b"short"), (part, part + b"x")):
        path.write_bytes(before)
        descriptors: list[int] = []

        def change(descriptor: int, descriptors: list[int] = descriptors, now: bytes = now) -> os.stat_result:
            found = real(descriptor)
            if descriptors:  # its size is known, nothing is read yet
                path.write_bytes(now)
            descriptors.append(descriptor)
            return found

        with monkeypatch.context() as patch:
            patch.setattr(os, "fstat", change)
            with pytest.raises(OSError, match="changed while it was read"):
                read(path)


@pytest.mark.skipif(not Path("/proc/self/pagemap").exists(), reason="no such file on this system")
def test_files_that_the_kernel_makes_up_without_end_are_refused() -> None:
    """They are regular, of size 0, and hold terabytes."""
    with pytest.raises(OSError, match="changed while it was read: more than 0 bytes"):
        read_file(Path("/proc/self/pagemap"))


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no such file on this system")
def test_a_model_that_grows_while_it_is_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="changed while it was read"):
        read_obj(Path("/proc/self/status"))


def test_size_is_bounded_before_a_byte_is_read(tmp_path: Path) -> None:
    with (tmp_path / "a").open("wb") as stream:
        stream.truncate(5 << 30)
    with pytest.raises(OSError, match="holds 5368709120 bytes, limit 4294967296"):
        read_file(tmp_path / "a")
    with pytest.raises(OSError, match="holds 5368709120 bytes, limit 7"):
        parts_of = read_parts(tmp_path / "a", 7)
        next(parts_of)
    (tmp_path / "b").write_bytes(b"1234567")
    assert read_file(tmp_path / "b", 7) == b"1234567"


def test_a_larger_file_that_takes_a_files_place_after_a_look_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, real = tmp_path / "a", os.open
    path.write_bytes(b"1234567")

    def replaced(name: Any, *how: Any) -> int:
        if name == path:
            (tmp_path / "b").write_bytes(b"12345678")
            (tmp_path / "b").rename(path)
        return real(name, *how)

    monkeypatch.setattr(os, "open", replaced)
    with pytest.raises(OSError, match="holds 8 bytes, limit 7"):
        read_file(path, 7)


def test_names_that_no_file_can_have_are_errors_of_the_file() -> None:
    for name in ("a\0b", "\ud800"):
        with pytest.raises(OSError, match="no file can have this name"):
            read_file(Path(name))


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # Python closes the file
def test_an_interrupt_at_any_moment_of_opening_a_file_is_no_other_error(tmp_path: Path) -> None:
    """A signal raises where Python enters, calls or leaves a function, as a profiler may."""
    path = tmp_path / "a.bin"
    path.write_bytes(b"abc")
    interrupts = 0

    def come_after(count: int) -> Callable[..., None]:
        def event(*_: object) -> None:
            nonlocal count
            count -= 1
            if count == 0:
                raise KeyboardInterrupt

        return event

    while True:
        sys.setprofile(come_after(interrupts + 1))
        try:
            with open_file(path) as stream:
                sys.setprofile(None)
                assert stream.read() == b"abc"
            break
        except KeyboardInterrupt:
            interrupts += 1
        finally:
            sys.setprofile(None)
    assert interrupts > 10


def test_a_lock_is_made_and_held_on_regular_files_alone(tmp_path: Path) -> None:
    for _ in range(2):
        open_lock(tmp_path / "new").close()
    for kind in ("pipe", "endless", "folder"):
        spoil(tmp_path / "a", kind)
        with pytest.raises(OSError):
            open_lock(tmp_path / "a")


def test_links_in_a_circle_have_a_path(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    assert resolved(tmp_path / "a").parent == tmp_path


def test_a_library_sees_the_file_that_was_opened_and_not_what_took_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, real = tmp_path / "a.png", oiio.ImageInput.open
    codes = np.arange(16, dtype=np.uint8).reshape(4, 4, 1)

    class Replacing:
        @staticmethod
        def open(*arguments: Any) -> Any:
            spoil(path, "pipe")
            return real(*arguments)

    for read in (decode_png, lambda path: read_image(path).values):
        path.unlink(missing_ok=True)
        path.write_bytes(encode_png(codes))
        with monkeypatch.context() as patch:
            patch.setattr("paradize.readers.image.oiio.ImageInput", Replacing)
            patch.setattr("paradize.readers.image.check_damage", lambda path, kind: None)
            assert np.array_equal(read(path), codes)


def test_no_temporary_name_stays_and_none_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "of").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "of"))
    (tmp_path / "a.png").write_bytes(b"no picture")
    with pytest.raises(SourceError) as caught:
        read_image(tmp_path / "a.png")
    assert str(tmp_path / "of") not in str(caught.value)
    assert not list((tmp_path / "of").iterdir())


def test_an_open_file_is_closed_to_programs_that_are_started(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(ball(4))
    with open_file(tmp_path / "a.obj") as stream:
        command = [sys.executable, "-c", f"import os; os.fstat({stream.fileno()})"]
        ran = subprocess.run(command, capture_output=True, close_fds=False)
    assert b"Bad file descriptor" in ran.stderr


def test_a_pipe_with_a_writer_is_refused_unread(tmp_path: Path) -> None:
    pipe(tmp_path / "a")
    end = os.open(tmp_path / "a", os.O_RDWR)
    try:
        os.write(end, b"v 0 0 0")
        with pytest.raises(SourceError, match="is not a regular file"):
            read_obj(tmp_path / "a")
        assert os.read(end, 100) == b"v 0 0 0"
    finally:
        os.close(end)
