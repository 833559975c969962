"""The file that is meant by a name that leads to none."""

from __future__ import annotations

from pathlib import Path

import pytest

from paradize.spelling import in_other_letters, similar


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in (
        "Trees/palm.mtl",
        "Trees/palm.obj",
        "Trees/palm.png",
        "Trees/Caf\u00e9.png",
        "a.txt",
        "A.txt",
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    return tmp_path


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("Trees/palm.obj", "Trees/palm.obj"),
        ("trees/PALM.OBJ", "Trees/palm.obj"),
        ("trees/cafe\u0301.PNG", "Trees/Caf\u00e9.png"),
        ("A.txt", "A.txt"),
        ("A.TXT", None),  # either of two
        ("Trees/palms.obj", None),
        ("palm.obj", None),
        ("a.txt/b", None),
    ],
)
def test_other_letters_lead_to_the_only_name_that_has_them(
    folder: Path, name: str, found: str | None
) -> None:
    assert in_other_letters(folder, name) == found


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("trees\\palm.ob", "Trees/palm.obj"),
        ("Trees/plam.png", "Trees/palm.png"),
        ("Trees/palms.mtl", "Trees/palm.mtl"),
        ("Trees/cafe.png", "Trees/Caf\u00e9.png"),
        ("A.TXT", "A.txt"),
        ("Tree/palm.obj", None),
        ("Trees/lagoon.png", None),
        ("../a.txt", None),
    ],
)
def test_the_nearest_spelling_is_meant_with_the_nearest_suffix(
    folder: Path, name: str, meant: str | None
) -> None:
    assert similar(folder, name) == meant
