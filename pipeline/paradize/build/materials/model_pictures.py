"""Reads the pictures that a model names, beside it or inside its file."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from paradize.errors import ParadizeError
from paradize.readers.image import read_image

if TYPE_CHECKING:
    from paradize.data import Image
    from paradize.material import Picture


def read_picture(picture: Picture, color_space: str | None = None) -> Image:
    """The decoded picture. color_space: as read_image takes it. Raises SourceError that names the picture."""
    if picture.data is None:
        return read_image(picture.file, color_space=color_space)
    with tempfile.NamedTemporaryFile() as inside:
        inside.write(picture.data)
        inside.flush()
        try:
            return read_image(Path(inside.name), color_space=color_space)
        except ParadizeError as error:
            raise error.renamed({inside.name: f"{picture.file}: picture {picture.name!r}"}) from None
