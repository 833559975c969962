"""The content-addressed store. local.py: the store on disk. shared.py: a store that several people share.

atomic.py writes files completely or not at all. file_hashes.py caches the hashes of unchanged files.
"""

__all__ = ["atomic", "clean", "file_hashes", "local", "remote_folder", "shared"]
