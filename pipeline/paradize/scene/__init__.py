"""Reads the scene file and derives what the scene requires.

settings/ declares every field with its default, unit, range and meaning (FIELDS.md lists them). schema/
reads a table of TOML. budget.py defines the metrics. flight.py is the camera path. requirements.py lists the
artifacts and the passes that read each.
"""

__all__ = [
    "baker_settings",
    "budget",
    "daytime",
    "finest_views",
    "flight",
    "jobs",
    "map_sets",
    "motion",
    "pass_inputs",
    "placement",
    "ranges",
    "reference",
    "requirements",
    "schema",
    "setting_rules",
    "settings",
    "sightings",
]
