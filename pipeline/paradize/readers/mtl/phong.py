"""Factors of Phong's model of light as MTL writes them (Ns, Ks), as those of glTF's.

A Blinn-Phong exponent n is the roughness alpha = sqrt(2 / (n + 2)): B. Walter, S. Marschner, H. Li, K.
Torrance, "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, section 5.2. The intensity
that keeps the peak of a highlight is 8 / (n + 8) of Ks: T. Akenine-Moeller, E. Haines, N. Hoffman, "Real-Time
Rendering", 3rd edition, 2008, section 7.6. Blender writes numbers of its own: Ns = 1000 (1 - roughness)^2,
and Ks 0.5 stands for a reflection of 4 %.

Phong's Ks is not what a surface reflects of its surroundings, which Phong's light does not know: many files
say Ks 1 for anything that shines. No coloured surface but a metal reflects more than 8 % seen straight on (N.
Hoffman, "Background: Physics and Math of Shading", SIGGRAPH 2013): that is the limit for those.
"""

from __future__ import annotations

from math import sqrt

from paradize.material import PLASTIC_REFLECTANCE

_MOST = 0.08  # of what is not a metal
_BLACK = 0.04  # Kd up to here: a metal, whose colour is Ks
_BLENDER_NS, _BLENDER_KS = 1000.0, 0.5


def roughness_of(exponent: float, blender: bool) -> float:
    """glTF's roughness, sqrt(alpha), 0..1, of a Blinn-Phong exponent. Exponents below 0 count as 0."""
    exponent = max(exponent, 0.0)
    if blender:
        return 1.0 - sqrt(min(exponent / _BLENDER_NS, 1.0))
    return sqrt(sqrt(2.0 / (exponent + 2.0)))


def specular_of(ks: tuple[float, float, float], exponent: float | None, *, kd: float) -> float:
    """Material.specular of the mean of Ks, for Phong's light. exponent: Ns; None: none is given. kd: the
    largest part of Kd; 1 for a colour map."""
    reflected = _mean(ks) * 8.0 / (max(exponent or 0.0, 0.0) + 8.0)
    return (reflected if kd <= _BLACK else min(reflected, _MOST)) / PLASTIC_REFLECTANCE


def specular_of_reflectance(ks: tuple[float, float, float]) -> float:
    """Material.specular where Ks is the reflection at normal incidence."""
    return _mean(ks) / PLASTIC_REFLECTANCE


def specular_of_blender(ks: tuple[float, float, float]) -> float:
    """Material.specular of Ks as Blender writes it."""
    return _mean(ks) / _BLENDER_KS


def _mean(ks: tuple[float, float, float]) -> float:
    return min(max(sum(ks) / 3.0, 0.0), 1.0)
