"""`paradize check`: rules with stable codes over baked scenes, meshes and textures."""

from paradize.check.paths import check_paths
from paradize.check.render import render
from paradize.check.rules import RULES, Finding
from paradize.check.scenes import CheckOptions

__all__ = ["RULES", "CheckOptions", "Finding", "check_paths", "render"]
