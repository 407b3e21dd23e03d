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
_TYPES = {
    "float64": "speed_rad_s amplitude phase_deg std_re std_im cov_re_im weight angle_deg radius re im "
    "var_re var_im before after limit",
    "int64": "repeat trial_runs check_runs vectors",
    "bool": "mounted",
    "date32": "date",
}
"""Columns that are no texts, by the types of Arrow."""
TABLES = {name: tuple(columns.split()) for name, columns in _COLUMNS.items()}
"""Columns of each table, in the order in which they are written: `jobs` last."""
Columns = dict[str, Sequence[Any]]
"""Cells by column."""
JobRows = dict[str, list[Columns]]
"""Rows of one job, in parts, by table."""


def arrow() -> Any:  # noqa: ANN401 - the module
    """The module pyarrow; ValueError where the extra is not installed."""
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise ValueError("the tables of a fleet need pyarrow: pip install pyarrow") from error
    return pyarrow


def arrow_table(name: str, parts: Sequence[Columns]) -> Any:  # noqa: ANN401 - of pyarrow
    """A table of rows in parts, with the version of the tables; NaN is null."""
    pa = arrow()
    types = {column: kind for kind, columns in _TYPES.items() for column in columns.split()}
    types |= dict.fromkeys(("files", "warnings"), pa.list_(pa.string()))
    fields = [(column, types.get(column, "string")) for column in TABLES[name]]
    schema = pa.schema(fields, metadata={"schema_version": VERSION})
    arrays = []
    for field in schema:
        cells = [cell for part in parts for cell in part[field.name]]
        arrays.append(pa.array(cells, field.type, from_pandas=True))
    return pa.Table.from_arrays(arrays, schema=schema)
