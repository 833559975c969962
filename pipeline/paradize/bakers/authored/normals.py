"""Judges a picture that is said to be a normal map: how it holds normals, what is wrong with it, and whether
its green points down."""

from __future__ import annotations

from functools import reduce
from operator import add
from pathlib import Path

import numpy as np
import numpy.typing as npt

from paradize.bakers.authored.pictures import RolePicture
from paradize.bakers.maps.rows import Layout
from paradize.errors import SourceError
from paradize.stages.authored import (
    UNIT_WITHIN,
    NormalCoding,
    NormalSurvey,
    decoded_normals,
    is_signed,
    survey_normals,
)
from paradize.stages.green import guess_green
from paradize.stages.sweep import bands_of

_OFF_SHARE = 0.1  # of the texels: more whose length is not 1 are a warning
_BELOW_SHARE = 0.001  # the same of those that point into the surface
_LEANING = 0.15  # how far normals of a surface lean on the mean, as a share of z
_SAMPLE = 1024  # texels along a side that the direction of green is guessed from


def normal_coding(
    picture: RolePicture, layout: Layout | None, *, green_down: bool | None, scale: float
) -> tuple[NormalCoding, list[str]]:
    """How the picture holds normals, and warnings. green_down: None: as its slopes say. Raises SourceError
    for a picture that is not a normal map."""
    values, path = picture.values, picture.path
    inside = np.ones(picture.size, np.bool_) if layout is None else layout.islands >= 0
    coding = NormalCoding(
        signed=is_signed(values), without_z=bool(values[:, :, :2].any() and not values[:, :, 2].any())
    )
    seen = reduce(
        add,
        (survey_normals(values[a:b], coding, inside[a:b]) for a, b in bands_of(*picture.size)),
        NormalSurvey(),
    )
    _require_normals(seen, path)
    warnings = _warnings(seen, path)
    guess = _guess(values, coding)
    if green_down is None:
        green_down = guess == "down"
        if green_down:
            warnings.append(
                f"{path}: green seems to point down (DirectX), by its slopes, and is turned up; "
                'green = "down" or "up" says it for sure'
            )
    elif guess is not None and green_down != (guess == "down"):
        said = "down (DirectX)" if green_down else "up (OpenGL)"
        warnings.append(
            f"{path}: green is said to point {said}, but its slopes fit together only if it points {guess}; "
            "bumps would look like dents where that is so"
        )
    return NormalCoding(coding.signed, coding.without_z, green_down, scale), warnings


def _guess(values: npt.NDArray[np.generic], coding: NormalCoding) -> str | None:
    top, left = (max(0, (size - _SAMPLE) // 2) for size in values.shape[:2])
    part = values[top : top + _SAMPLE, left : left + _SAMPLE]
    bands = bands_of(*part.shape[:2])
    return guess_green(np.concatenate([decoded_normals(part[first:last], coding) for first, last in bands]))


def _require_normals(seen: NormalSurvey, path: Path) -> None:
    """Raises SourceError for a picture of something else: grey, pointing into the surface in a quarter of the
    texels (normals of an object's space do), or in a twentieth where half of them is not of unit length and
    they lean to a side (a photograph; steep normals that a program left short do not)."""
    kept = seen.texels - seen.black
    what = None
    if kept == 0 and seen.texels:
        what = "every texel is black"
    elif 2 * seen.grey > kept:
        what = f"{seen.grey} of {kept} texels are grey"
    elif 4 * seen.below > kept or (
        20 * seen.below > kept and 2 * seen.off > kept and abs(seen.side) > _LEANING * seen.up
    ):
        what = f"{seen.below} of {kept} texels would point into the surface (blue below the middle)"
    if what is not None:
        mend = "give a normal map in tangent space, or give heights as the height"
        raise SourceError(f"is not a normal map in tangent space: {what}", file=path, mend=mend)


def _warnings(seen: NormalSurvey, path: Path) -> list[str]:
    kept = max(1, seen.texels - seen.black)
    found = []
    if seen.off > _OFF_SHARE * kept:
        share = 100.0 * seen.off / kept
        found.append(
            f"{path}: {share:.3g} % of its normals are longer or shorter than 1 by more than {UNIT_WITHIN:g} "
            f"(at most {seen.largest:.2g}); each is made unit"
        )
    if seen.below > _BELOW_SHARE * kept:
        share = 100.0 * seen.below / kept
        found.append(
            f"{path}: {share:.3g} % of its normals point into the surface (blue below the middle); they are "
            "laid flat on it"
        )
    return found
