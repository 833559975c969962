"""Errors in physical units. Each metric has one reference that no stage shares; README.md lists them."""
