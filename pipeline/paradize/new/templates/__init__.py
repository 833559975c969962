"""The templates of `paradize new --template`: the text of each scene, and the sources that it names.

empty.toml, island.toml, and night.toml, which is what a night has beside the island. island.py makes its
sources.
"""

TEMPLATES = ("empty", "island", "night")
