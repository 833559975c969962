"""`paradize measure`: what each tier of each stage costs and errs. scene.py does so for a scene."""
