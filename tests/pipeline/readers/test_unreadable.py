"""Files that this user may not read."""

from __future__ import annotations

import errno
import os
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from paradize.checks import check_paths
from paradize.errors import ParadizeError
from paradize.readers.heightmap import read_heightmap
from paradize.readers.image import read_image
from paradize.readers.model import read_model
from paradize.readers.sound import read_sound
from paradize.scene.settings import load_scene

READERS = {
    "a.obj": read_model,
    "a.stl": read_model,
    "a.ply": read_model,
    "a.gltf": read_model,
    "a.png": read_image,
    "a.hgt": partial(read_heightmap, size_x_m=1.0, size_z_m=1.0, height_m=1.0),
    "a.ogg": read_sound,
    "a.toml": load_scene,
}


@pytest.mark.parametrize("name", READERS)
def test_a_file_that_may_not_be_read_is_told_with_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = tmp_path / name
    path.write_bytes(b"{}")
    _forbid(monkeypatch, path)
    with pytest.raises(ParadizeError, match=r"cannot be read: Permission denied; let this user read it"):
        READERS[name](path)
    (finding,) = check_paths([path])
    assert (finding.what.rpartition(": ")[2], finding.mend[:22]) == (
        "Permission denied",
        "let this user read it ",
    )


def _forbid(monkeypatch: pytest.MonkeyPatch, path: Path) -> None:
    """As the file system does for who is not root."""
    system_open = os.open

    def refusing(name: Any, *arguments: Any, **options: Any) -> int:
        if str(name) == str(path):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return system_open(name, *arguments, **options)

    monkeypatch.setattr(os, "open", refusing)
