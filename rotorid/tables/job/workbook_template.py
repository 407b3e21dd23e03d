"""Template: the empty workbook to fill in at the machine, a file of the package."""

from __future__ import annotations

from pathlib import Path


def template_bytes() -> bytes:
    """An empty workbook for a balancing job.

    Returns
    -------
    bytes
        Sheets runs, weights, planes, sensors and settings to fill in, with comments on their headers and
        lists of allowed values; a sheet notes with all explanations and an example.
    """
    return Path(__file__).with_name("template.xlsx").read_bytes()
