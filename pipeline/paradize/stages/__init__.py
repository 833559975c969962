"""Pure functions: data and settings in, data out; no files, no globals, no clock. One algorithm a file."""
