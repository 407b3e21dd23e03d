"""Model files for identification, read and written."""
