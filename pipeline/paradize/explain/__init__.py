"""`paradize explain`: which pass reads an artifact, when the flight needs it, and how far its error moves a
pixel.

facts.py collects the facts, words.py prints them. bounds.py, surfaces.py and pixels.py bound the error in
pixels; economy.py counts the bytes saved; gutters.py explains the gutters of UV layouts."""

__all__ = ["facts", "words"]
