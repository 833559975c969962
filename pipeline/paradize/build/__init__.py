"""Bakes a scene: requirements -> jobs -> artifacts -> a published folder. Start with bake.py.

tasks.py gives each job a key and looks it up in the store. tiers/auto_tier.py chooses tiers. trim.py leaves
out what no view needs. publish.py writes the folder. provenance.py records what was read, run and written.
"""

__all__ = [
    "bake",
    "budget_metrics",
    "entries",
    "job_inputs",
    "materials",
    "options",
    "provenance",
    "single_file",
    "tasks",
    "verify",
]
