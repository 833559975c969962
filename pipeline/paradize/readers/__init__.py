"""Readers of what people bring: OBJ, MTL, pictures, heightmaps, sounds."""
