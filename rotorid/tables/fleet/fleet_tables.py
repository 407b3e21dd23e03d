"""The tables of a fleet, told once: columns in SI, phases as lead, angles with the rotation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rotorid.base.versions import SCHEMA_VERSION

VERSION = str(SCHEMA_VERSION)
_COLUMNS = {
    "readings": "job kind run repeat speed_rad_s sensor amplitude phase_deg std_re std_im cov_re_im",
    "weights": "job kind run plane weight angle_deg",
    "coefficients": "job speed_rad_s sensor plane radius re im var_re cov_re_im var_im source",
    "corrections": "job plane weight angle_deg mounted",
    "outcomes": "job run speed_rad_s sensor before after limit",
    "jobs": "job path machine machine_type date quantity weight_kind vibration_unit weight_unit files "
    "runs_file warnings trial_runs check_runs vectors undetermined",
}
_KINDS = {
    "number": "speed_rad_s amplitude phase_deg std_re std_im cov_re_im weight angle_deg radius re im "
    "var_re var_im before after limit",
    "count": "repeat trial_runs check_runs vectors",
    "flag": "mounted",
    "date": "date",
    "texts": "files warnings",
}
"""Columns that are no texts."""
TABLES = {name: tuple(columns.split()) for name, columns in _COLUMNS.items()}
"""Columns of each table, in the order in which they are written: `jobs` last."""
Columns = dict[str, Sequence[Any]]
"""Cells by column."""
JobRows = dict[str, list[Columns]]
"""Rows of one job, in parts, by table."""


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
        "number": pa.float64(),
        "count": pa.int64(),
        "flag": pa.bool_(),
        "date": pa.date32(),
        "texts": pa.list_(pa.string()),
    }
    kind_of = {column: kinds[kind] for kind, columns in _KINDS.items() for column in columns.split()}
    columns = [(column, kind_of.get(column, pa.string())) for column in TABLES[name]]
    return pa.schema(columns, metadata={"schema_version": VERSION})


def arrow_table(name: str, parts: Sequence[Columns]) -> Any:  # noqa: ANN401 - of pyarrow
    """A table of rows in parts; NaN is null."""
    own = schema(name)
    cells = ([cell for part in parts for cell in part[field.name]] for field in own)
    arrays = [
        arrow().array(each, field.type, from_pandas=True) for each, field in zip(cells, own, strict=True)
    ]
    return arrow().Table.from_arrays(arrays, schema=own)
