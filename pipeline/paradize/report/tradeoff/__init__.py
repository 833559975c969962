"""The page of `paradize measure`: page.py writes it, plot.py draws its curves, style.py holds its CSS."""
