"""OBJ text to arrays beside tinyobjloader and beside counting the newlines of the same file.

The mesh is made here: a dense torus with relief, 438 thousand vertices and 872 thousand triangles with v,
vt and vn, 91 MB of text. All of it is work of one thread: times are those of the thread, kernel included.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from meshes import write_torus
from paradize.kernels.obj import parse_obj, parse_obj_file
from row import BASELINE, Row, on, pair_ms

COLUMNS, ROWS = 934, 467


def read_file(file: Path) -> object:
    with file.open("rb", buffering=0) as opened:
        return parse_obj_file(opened.fileno())


def rows(runs: int, folder: Path) -> Iterator[Row]:
    file = folder / "torus.obj"
    write_torus(file, COLUMNS, ROWS, lobes=40)
    size = f"{file.stat().st_size / 1e6:.0f} MB with v, vt, vn"
    try:
        import tinyobjloader
    except ImportError:
        print("tinyobjloader is not installed (setup/python-bench.txt): its row is left out\n", flush=True)
    else:

        def peer() -> None:
            config = tinyobjloader.ObjReaderConfig()
            reader = tinyobjloader.ObjReader()
            assert reader.ParseFromFile(str(file), config), reader.Error()

        ours_ms, peer_ms = pair_ms(lambda: read_file(file), peer, runs, time.thread_time)
        said = "its own index per v, vt, vn; no vertices shared"
        yield Row(
            f"OBJ file to arrays with shared vertices, {size}, 1 thread",
            ours_ms,
            "tinyobjloader",
            peer_ms,
            "exact",
            said,
            limit=5,
            inside="reading the file; the thread's own time, kernel included",
            ours_on=on(1),
            peer_on=on(1, BASELINE),
        )
    text = file.read_bytes()
    ours_ms, peer_ms = pair_ms(lambda: parse_obj(text), lambda: text.count(b"\n"), runs, time.thread_time)
    name = "newlines of the same bytes counted (bytes.count, memchr)"
    yield Row(
        f"OBJ text in memory to arrays, {size}, 1 thread", ours_ms, name, peer_ms, "exact", "-", limit=0.5,
        inside="text in memory; the thread's own time", ours_on=on(1), peer_on=on(1, "libc's memchr"),
    )  # fmt: skip
    ours_ms, peer_ms = pair_ms(
        lambda: read_file(file), lambda: file.read_bytes().count(b"\n"), runs, time.thread_time
    )
    name = "file read and newlines counted"
    yield Row(
        f"OBJ file to arrays, {size}, 1 thread", ours_ms, name, peer_ms, "exact", "-", limit=0.5,
        inside="reading the file; the thread's own time, kernel included", ours_on=on(1),
        peer_on=on(1, "libc's memchr"),
    )  # fmt: skip
