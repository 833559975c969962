"""The record of an artifact: what each reader takes of it."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest

from paradize.artifact import KEPT, PUBLISHED, REPORTED, Artifact
from paradize.build.entries import PRODUCTS, fits
from paradize.formats.scene.fields import Wrong
from paradize.formats.scene.schema import check_artifact

MADE = Artifact(
    "post_color",
    kind="texture",
    suffix="ktx2",
    sha256="0123456789abcdef" * 4,
    bytes=1200,
    tier="exact",
    errors={"color_psnr_db": 41.5},
    levels=[{"psnr_db": 41.5, "max": 0.1}],
    format="BC7_SRGB",
    reason="BC1 exceeds the budget",
    warnings=["its texels stand apart"],
    status="reused",
    seconds=1.5,
    over=["color_psnr_db is 41.5 dB"],
    left_out=1,
)


def test_the_store_gives_back_what_it_was_given() -> None:
    kept = MADE.to_json(KEPT)
    assert fits({"color": kept}, PRODUCTS)
    assert Artifact.from_json(kept, name="color").to_json(KEPT) == kept


def test_a_report_gives_back_what_it_was_given() -> None:
    result = MADE.to_json(REPORTED)
    assert result["file"] == "post_color-01234567.ktx2"
    assert Artifact.from_json(result).to_json(REPORTED) == result


def test_what_was_not_made_has_no_file() -> None:
    assert Artifact("post_color", status="failed").to_json(REPORTED)["file"] is None


@pytest.mark.parametrize("left", PUBLISHED)
def test_scene_json_holds_what_is_published_and_nothing_else(left: str) -> None:
    result = MADE.to_json(PUBLISHED)
    check_artifact(result, "artifacts.post_color")
    del result[left]
    assert place_of_fault(result) == f"artifacts.post_color.{left}"
    assert place_of_fault(MADE.to_json((*PUBLISHED, "status"))) == "artifacts.post_color.status"


def place_of_fault(entry: dict[str, Any]) -> str:
    with pytest.raises(Wrong) as found:
        check_artifact(entry, "artifacts.post_color")
    return found.value.place


def test_every_field_is_told_somewhere() -> None:
    result = {*KEPT, *REPORTED, *PUBLISHED}
    assert {one.name for one in fields(Artifact)} <= result
