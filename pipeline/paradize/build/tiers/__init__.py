"""Tier `auto`: the cheapest tier whose measured errors are inside the budget, and settings between tiers."""
