"""`paradize explain`: which pass asked for an artifact, when the flight needs it, and what its error moves.

facts.py finds the facts, words.py prints them; bounds.py composes the errors of an artifact into pixels.
"""
