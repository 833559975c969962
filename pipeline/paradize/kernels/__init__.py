"""C++ kernels, one folder per topic. Its `__init__` checks the arrays and calls the native module beside it.

simd/ and math/ are shared by topics. reference/ holds the kernels of the metrics; no stage imports it.
"""

__all__ = [
    "atlas",
    "bc7",
    "bcn",
    "filter",
    "gutter",
    "maps",
    "math",
    "mesh",
    "normals",
    "obj",
    "occlusion",
    "openmesh",
    "reference",
    "simplify",
    "terrain",
    "threads",
]
