"""The content-addressed store. local.py is the store on disk, shared.py one that others share behind it.

atomic.py writes files whole or not at all; file_hashes.py remembers the hashes of unchanged files.
"""
