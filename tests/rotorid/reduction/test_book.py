"""The files of `sample_data/book_task_9`: inputs of tasks 9.1 and 9.2 of [S]."""

import numpy as np
import pytest

import fem
from rotorid import InputError, read_rotor
from rotorid.files.node_tables import read_compliance, read_modes
from rotorid.samples import sample_data

NODES = (7, 12, 18)


def task(suffix=""):
    folder = sample_data() / "book_task_9"
    modes = read_modes(folder / f"modes{suffix}.csv")
    nodes, alpha = read_compliance(folder / f"compliance{suffix}.csv", modes.nodes)
    assert nodes == modes.nodes == NODES
    return alpha, modes.frequencies, modes.shapes


@pytest.fixture(scope="module")
def exact():
    return task()


def test_the_exact_inputs_are_those_of_the_rotor(exact):
    rotor = read_rotor(sample_data() / "rotor23.csv")
    found = fem.critical_speeds(rotor, 3)
    rows = found.shapes[np.array(NODES) - 1]
    np.testing.assert_allclose(exact[0], fem.compliance(rotor, NODES), rtol=1e-10)
    np.testing.assert_allclose(exact[1], found.frequencies, rtol=1e-10)
    np.testing.assert_allclose(exact[2], rows / rows[0], rtol=1e-9)


def test_the_compliance_of_the_running_text_is_refused(tmp_path):
    """It prints α22 as 9.35e-8, the value of α33: no shaft bends like that."""
    text = (sample_data() / "book_task_9" / "compliance_printed.csv").read_text(encoding="utf-8")
    assert "12,12,16.4e-8" in text
    path = tmp_path / "compliance.csv"
    path.write_text(text.replace("12,12,16.4e-8", "12,12,9.35e-8"), encoding="utf-8")
    with pytest.raises(InputError, match=r"positive definite"):
        read_compliance(path)
