"""Errors in physical units. Each metric has one reference that no stage shares; ERRORS.md lists them."""
