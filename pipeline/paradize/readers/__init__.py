"""Readers of source files: OBJ, MTL, pictures, heightmaps, sounds."""
