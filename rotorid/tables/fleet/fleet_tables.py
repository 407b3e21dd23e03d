"""The tables of a fleet, told once: columns in SI, phases as lead, angles with the rotation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rotorid.base.versions import SCHEMA_VERSION

VERSION = str(SCHEMA_VERSION)
_JOB = {"job": "text"}
_READING = {"speed_rad_s": "number", "sensor": "text"}
_WEIGHT = {"plane": "text", "weight": "number", "angle_deg": "number"}
TABLES: dict[str, dict[str, str]] = {
    "readings": {
        **_JOB,
        **{"kind": "text", "run": "text", "repeat": "count"},
        **_READING,
        **{"amplitude": "number", "phase_deg": "number"},
        **{"std_re": "number", "std_im": "number", "cov_re_im": "number"},
    },
    "weights": {**_JOB, "kind": "text", "run": "text", **_WEIGHT},
    "coefficients": {
        **_JOB,
        **_READING,
        **{"plane": "text", "re": "number", "im": "number"},
        **{"var_re": "number", "cov_re_im": "number", "var_im": "number", "source": "text"},
    },
    "corrections": {**_JOB, **_WEIGHT, "mounted": "flag"},
    "outcomes": {
        **_JOB,
        **{"run": "text"},
        **_READING,
        **{"before": "number", "after": "number", "limit": "number"},
    },
    "jobs": {
        **_JOB,
        **{"path": "text", "machine": "text", "machine_type": "text", "date": "date"},
        **{"quantity": "text", "weight_kind": "text", "vibration_unit": "text", "weight_unit": "text"},
        **{"files": "texts", "runs_file": "text", "warnings": "texts"},
        **{"trial_runs": "count", "check_runs": "count", "vectors": "count", "undetermined": "text"},
    },
}
"""Kind of each column of each table, in the order in which they are written: `jobs` last."""
Rows = dict[str, dict[str, list[Any]]]
"""Cells of each column of each table."""


def arrow() -> Any:  # noqa: ANN401 - the module
    """The module pyarrow.

    Raises
    ------
    ValueError
        Where the extra is not installed.
    """
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise ValueError('the tables of a fleet need pyarrow: pip install "rotorid[fleet]"') from error
    return pyarrow


def schema(name: str) -> Any:  # noqa: ANN401 - of pyarrow
    """The schema of a table, with the version of the tables."""
    pa = arrow()
    kinds = {
        "text": pa.string(),
        "texts": pa.list_(pa.string()),
        "number": pa.float64(),
        "count": pa.int64(),
        "flag": pa.bool_(),
        "date": pa.date32(),
    }
    columns = [(column, kinds[kind]) for column, kind in TABLES[name].items()]
    return pa.schema(columns, metadata={"schema_version": VERSION})


def no_rows() -> Rows:
    """Tables without any row, to add to."""
    return {name: {column: [] for column in columns} for name, columns in TABLES.items()}


def add_rows(rows: Rows, more: Mapping[str, Mapping[str, Sequence[Any]]]) -> None:
    """Add rows to each column of each table."""
    for name, columns in more.items():
        for column, cells in columns.items():
            rows[name][column].extend(cells)
