"""The figures of the documentation: what the commands of its pages draw from the sample data."""

from __future__ import annotations

import contextlib
import io
import os
import shlex
import tempfile
import warnings
from pathlib import Path

ROOT = Path(__file__).parents[1]
COMPRESSOR = "sample_data/compressor/rotor.toml"
FIGURES = {
    "balance": "balance sample_data/turbo_job/job.toml",
    "discs": "balance sample_data/turbo_job/holes.toml --split",
    "modes": "critical sample_data/rotor23.csv -n 3",
    "campbell": f"campbell {COMPRESSOR} --speeds 1000:15000:500rpm",
    "response": f"response {COMPRESSOR} --unbalance sample_data/compressor/unbalance.csv "
    "--speeds 1000:15000:100rpm --sensors 'probe DE:45,probe NDE:45' --operating 5300:6500rpm",
    "reduction": "reduce sample_data/rotor23.csv --nodes 7,12,18 --modes 2",
    "fit": "fit sample_data/fit/run_down/model.toml sample_data/fit/run_down/record.csv",
}
"""Commands by the name of the figure, without `rotorid` and `--plot`."""
DENSE = ("fit",)
"""Figures of so many points that pixels are smaller."""


def kind(name: str) -> str:
    """How a figure is drawn, svg or png."""
    return "png" if name in DENSE else "svg"


def picture(name: str) -> bytes:
    """Run the command of a figure in the folder of the repository, and return what it draws.

    Raises
    ------
    KeyError
        For a name that is not in `FIGURES`.
    """
    import matplotlib

    from rotorid.cli import app

    words = shlex.split(FIGURES[name])
    os.environ.setdefault("SOURCE_DATE_EPOCH", "0")
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(ROOT),
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
        matplotlib.rc_context({"svg.hashsalt": name}),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")
        target = Path(folder) / f"{name}.{kind(name)}"
        app([*words, "--plot", str(target)], standalone_mode=False)
        return target.read_bytes()
