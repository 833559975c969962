"""The command line: one file per command, named after it; main.py parses and calls them."""

__all__ = ["interrupt", "main"]
