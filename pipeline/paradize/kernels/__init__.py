"""C++ kernels, a folder per topic: its `__init__` checks arrays and calls the native module built beside it.

simd/ and math/ are shared by topics. reference/ holds what metrics measure with; no stage imports it.
"""
