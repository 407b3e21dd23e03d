"""Printable sheets: one self-contained HTML file per result, readable without the program.

`rotorid.report.page` holds what all sheets share; every other module makes the sheet of one command.
"""
