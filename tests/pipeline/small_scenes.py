"""Parts of the cove, for tests that need only some of what it holds."""

from __future__ import annotations

from pathlib import Path

from tests.pipeline.scenes import make_cove, make_free_cove


def without_object(scene: Path) -> Path:
    """The cove without its object, whose levels of detail take most of a bake: 9 artifacts."""
    return cut(scene, "[[object]]", "[[particles]]")


def sky_and_sound(scene: Path) -> Path:
    """The cove's sky, sound and flight alone."""
    return cut(scene, "[shadow]", "[sound]")


def cut(scene: Path, first: str, after: str) -> Path:
    """Takes the tables of a scene from `first` to the one before `after` out."""
    text = scene.read_text()
    scene.write_text(text[: text.index(first)] + text[text.index(after) :])
    return scene


def make_post(folder: Path) -> Path:
    """The cove's object and its flight alone."""
    return cut(cut(make_cove(folder), "[fog]", "[[object]]"), "[[particles]]", "[flight]")


def sky_and_water(folder: Path) -> Path:
    """The cove's sky, water, sound and flight alone."""
    return cut(cut(make_cove(folder), "[shadow]", "[water]"), "[[object]]", "[sound]")


def make_free_post(folder: Path) -> Path:
    """The object with a free camera, which may go far away: no coarse level of it is left out."""
    return cut(cut(make_free_cove(folder), "[fog]", "[[object]]"), "[[particles]]", "[flight]")
