"""[Q] and [F] from the files in sample_data/fit by every method; [F]'s algorithm, step by step."""

import numpy as np
import pytest

from rotorid.files import read_ode_model, read_record
from rotorid.identify.fit_records import fit
from rotorid.samples import sample_data

FOLDER = sample_data() / "fit"


def as_f_prints(record, beta, steps):
    """[F] steps 1 to 4: (3.1) to (3.3) and sensitivities (3.7) by the printed Runge–Kutta, and Δβ."""
    c2, c3, c4, m3 = 0.3, 0.2, 0.12, 18.0
    t, y = record.t, np.stack(list(record.outputs.values()), axis=1)
    path = [beta]

    def f(z, beta):
        c1, m1, m2 = beta
        A = np.zeros((6, 6))
        A[0, 1] = A[2, 3] = A[4, 5] = 1.0
        A[1, [0, 2]] = -(c2 + c1) / m1, c2 / m1
        A[3, [0, 2, 4]] = c2 / m2, -(c2 + c3) / m2, c3 / m2
        A[5, [2, 4]] = c3 / m3, -(c4 + c3) / m3
        x, U = z[:, 0], z[:, 1:]
        by_beta = np.zeros((6, 3))
        by_beta[1, 0] = -x[0] / m1
        by_beta[1, 1] = ((c2 + c1) * x[0] - c2 * x[2]) / m1**2
        by_beta[3, 2] = (-c2 * x[0] + (c2 + c3) * x[2] - c3 * x[4]) / m2**2
        return np.column_stack([A @ x, A @ U + by_beta])

    for _ in range(steps):
        z = [np.column_stack([y[0], np.zeros((6, 3))])]  # y(t0) of the record, U(t0) = 0
        for h in np.diff(t):
            k1 = h * f(z[-1], beta)
            k2 = h * f(z[-1] + k1 / 2, beta)
            k3 = h * f(z[-1] + k2 / 2, beta)
            k4 = h * f(z[-1] + k3, beta)
            z.append(z[-1] + (k1 + 2 * k2 + 2 * k3 + k4) / 6)
        x, U = np.array(z)[:, :, 0], np.array(z)[:, :, 1:]
        normal = np.einsum("tij,tik->jk", U, U)
        beta = beta + np.linalg.solve(normal, np.einsum("tij,ti->j", U, y - x))
        path.append(beta)
    return np.array(path)


def test_the_algorithm_of_f_step_by_step():
    """The same parameters after every step, from the printed start; y(t0) is exact in this record."""
    model = read_ode_model(FOLDER / "three_masses" / "model.toml")
    record = read_record(FOLDER / "three_masses" / "record.csv", model)
    found = fit(model, record, method="gauss-newton", integrator="rk4")
    expected = as_f_prints(record, np.array([0.1, 11.0, 23.0]), found.iterations)
    np.testing.assert_allclose(found.history, expected, rtol=1e-9)
    assert found.history[-1] == pytest.approx([0.14, 12.0, 28.0], rel=1e-5)


def test_the_printed_record_is_a_sample_that_is_read():
    """What is intact of it, with gaps; by the printed method and integrator."""
    model = read_ode_model(FOLDER / "three_masses" / "model.toml")
    record = read_record(FOLDER / "three_masses" / "printed.csv", model, allow_missing=True)
    assert sum(np.isfinite(column).sum() for column in record.outputs.values()) == 383
    found = fit(model, record, method="gauss-newton", integrator="rk4")
    assert found.values == pytest.approx([0.1399996, 11.999993, 28.000002], abs=6e-7)
