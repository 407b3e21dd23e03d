"""Waveforms of a job: files of records in place of the tables of what was read in runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rotorid.files.columns import Source
from rotorid.files.problems import Problems
from rotorid.tables.job.job_data import Overrides


def with_vectors(
    tables: dict[str, Source], overrides: Overrides, phase: str | None, problems: Problems
) -> tuple[Overrides, tuple[Path, ...]]:
    """Put vectors in place of waveforms files, in the phase convention of the job, or else of these files.

    Vectors know their sign, so that nothing is assumed: a job that says nothing writes lead.
    """
    files: list[Path] = []
    for key in ("runs", "check", "slow_roll"):
        path = tables.get(key)
        if isinstance(path, Path) and path.suffix.lower() == ".toml":
            from rotorid.files.waveforms import read_vectors_grid

            grid, phase, read = problems.need(read_vectors_grid(path, overrides.phase or phase, problems))
            tables[key], files = grid, [*files, *read]
            overrides = replace(overrides, phase=phase)
    return overrides, tuple(files)
