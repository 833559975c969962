"""Source files that the tests make themselves, in folders named as those of the corpus: a kit of models that
share a palette, hard cases of OBJ, photographs and heights drawn by arithmetic, broken files.
What is tested on files of others is tested on these too: a clone without a corpus proves nearly as much.
"""

from __future__ import annotations

from pathlib import Path

from tests.made.broken import write_malformed
from tests.made.models import write_kit, write_nasty, write_tangent
from tests.made.pictures import write_heights, write_images, write_pairs, write_sky, write_textures

__all__ = ["make_sources"]


def make_sources(folder: Path) -> Path:
    """Writes all of them into a new folder; returns it. The same bytes in every run."""
    write_kit(folder / "obj-kits" / "made")
    write_nasty(folder / "obj-nasty" / "made")
    write_tangent(folder / "tangent" / "made")
    write_heights(folder / "height")
    write_textures(folder / "textures")
    write_images(folder / "images")
    write_sky(folder / "sky" / "made")
    write_pairs(folder / "pbr-pairs" / "made")
    write_malformed(folder)
    return folder
