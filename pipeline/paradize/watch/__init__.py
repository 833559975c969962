"""`paradize watch`: loop.py waits for saved files, rebake.py bakes again in a process that stays alive."""

__all__ = ["loop"]
