"""The report of a bake: a page with the scene's picture, errors, bytes and times, and a contact sheet of each
material, object and sky.

folder.py decides what is drawn anew, scene_page.py writes the page, poster.py has the player draw the
picture, sheet.py draws maps, levels.py and lod_view.py levels of detail; tradeoff/ is the page of `paradize
measure`."""

__all__ = ["folder", "poster", "tradeoff"]
