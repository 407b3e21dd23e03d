"""Balancing jobs: job files and workbooks, read, completed and written."""
