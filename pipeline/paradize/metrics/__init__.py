"""Errors in physical units, each against one reference that no stage shares: README.md has the table."""
