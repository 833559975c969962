"""A scene's requirements -> jobs -> artifacts -> a published folder. bake.py is the way in.

tasks.py gives each job its key and looks it up in the store; auto_tier.py picks tiers; trim.py leaves
out what no view asks for; publish.py writes the folder; provenance.py records what was read, run and written.
"""
