"""`paradize export`: writes a baked scene as one self-contained GLB."""

from __future__ import annotations

import argparse

from paradize.cli.options import add_json
from paradize.cli.output import say, show, show_json
from paradize.cli.values import path
from paradize.errors import one_line


def add(sub: argparse.ArgumentParser) -> None:
    """Declares the options of `paradize export`."""
    sub.add_argument("folder", type=path, metavar="DIR", help="a baked folder, or its scene.json")
    sub.add_argument("-o", "--out", type=path, required=True, metavar="OUT.glb", help="the file to write")
    add_json(sub)


def run(arguments: argparse.Namespace) -> int:
    """Exports; returns the exit code."""
    from paradize.cli.progress import progress
    from paradize.export.scene import export

    with progress() as shown:
        done = export(arguments.folder, arguments.out, shown.step)
    for note in done.notes:
        say(f"paradize: note: {note}")
    if arguments.json:
        result = {"file": str(done.file), "bytes": done.bytes, "triangles": done.triangles}
        show_json(result | {"pictures": done.pictures, "errors": done.errors, "warnings": done.notes})
    else:
        what = f"{done.bytes} bytes, {done.triangles} triangles, {done.pictures} pictures"
        camera = f"camera within {done.errors['path_export_m_max']:.2g} m of its path at 120 moments a second"
        show(one_line(f"{done.file}: {what}, {camera}"))
    return 0
