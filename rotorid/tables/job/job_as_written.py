"""What a job is read from: files, and what the caller says besides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rotorid.files.settings_keys import Quantity
from rotorid.tables.job.job_data import Overrides


@dataclass(frozen=True)
class JobSource:
    """What a job is read from: files, and what the caller says besides.

    Attributes
    ----------
    files
        A job (`.toml`, `.xlsx`), or a runs table and, perhaps, a weights table.
    influence
        Influence table, beside tables.
    overrides
        Conventions and errors in place of those of the job.
    max_weights, limits
        As `job_limits.with_limits` takes them.
    """

    files: tuple[Path, ...]
    influence: Path | None = None
    overrides: Overrides = field(default_factory=Overrides)
    max_weights: Mapping[str, Quantity] = field(default_factory=dict)
    limits: Mapping[str, Quantity] = field(default_factory=dict)
