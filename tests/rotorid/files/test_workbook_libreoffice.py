"""Workbooks that LibreOffice has opened, recalculated and saved: they still read, with the same answer.

Without LibreOffice the tests are skipped, and say which package brings it.
"""

import shutil
import subprocess

import openpyxl
import pytest
from tables_data import RUNS, WEIGHTS, replaced
from workbook_jobs import differences, filled, rows

from balancing import correct, estimate_influence
from rotorid.files import InputError, read_job

OFFICE = shutil.which("soffice") or shutil.which("libreoffice")
pytestmark = pytest.mark.skipif(
    OFFICE is None, reason="no LibreOffice on this machine: install Debian's package libreoffice-calc"
)


def saved(folder, *paths):
    """The workbooks as LibreOffice saves them, in the folder `out`."""
    own = f"-env:UserInstallation={(folder / 'profile').as_uri()}"
    command = [OFFICE, own, "--headless", "--norestore", "--convert-to", "xlsx:Calc MS Excel 2007 XML"]
    done = subprocess.run(
        [*command, "--outdir", folder / "out", *paths],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    found = [folder / "out" / path.name for path in paths]
    assert all(path.exists() for path in found), done.stdout + done.stderr
    return found


def test_a_form_filled_in_with_formulas_reads_after_libreoffice(tmp_path):
    numbers = filled(tmp_path / "numbers.xlsx", runs=rows(RUNS), weights=rows(WEIGHTS))
    formulas = replaced(replaced(RUNS, 4, "amplitude_um_pp", "=9.8/2"), 5, "phase_deg", "=E4+233")
    form = filled(tmp_path / "form.xlsx", runs=rows(formulas), weights=rows(WEIGHTS))
    with pytest.raises(InputError, match="formula"):
        read_job(form)  # nobody has calculated them
    (after,) = saved(tmp_path, form)
    assert openpyxl.load_workbook(after)["runs"]["E5"].value == "=E4+233"
    expected, found = read_job(numbers), read_job(after)
    assert differences(expected, found) == ()
    assert solved(found) == pytest.approx(solved(expected), rel=1e-12)


def solved(job):
    return correct(estimate_influence(job.trials)).weights
