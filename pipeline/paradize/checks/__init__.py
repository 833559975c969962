"""`paradize check`: rules with stable codes for baked scenes, meshes and textures.

paths.py finds out what a path is, scenes.py checks a baked scene; the other modules hold the rules, one topic
each. rules.py lists all rules, verdicts.py applies the severities and waivers of the scene, render.py prints.
"""

from paradize.checks.paths import check_paths
from paradize.checks.render import render
from paradize.checks.rules import Finding
from paradize.checks.scenes import CheckOptions

__all__ = ["CheckOptions", "Finding", "check_paths", "render"]
