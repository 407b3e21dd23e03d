"""[Q] and [F] from the files in sample_data/fit and from the intact printed values."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from rotorid.samples import sample_data
from rotorid.tables import read_ode_model, read_record
from rotorid.timedomain.fit import fit
from rotorid.timedomain.models.record import Record

FOLDER = sample_data() / "fit"
PRINTED = Path(__file__).parents[2] / "data" / "f_printed.csv"
METHODS = ["levenberg-marquardt", "gauss-newton", "quasilinearization", "multiple-shooting"]


def printed_record():
    """Values with standard deviations of their rounding (uniform within half a unit)."""
    table = pd.read_csv(PRINTED, comment="#")
    values = table.pivot(index="t_s", columns="state", values="value")
    deviations = table.pivot(index="t_s", columns="state", values="half_unit") / np.sqrt(3)
    outputs = {name: values[name].to_numpy() for name in values}
    sigma = {name: deviations[name].to_numpy() for name in deviations}
    return Record(values.index.to_numpy(), outputs, sigma=sigma, name="f_printed.csv")


def test_intact_printed_values_of_f_alone_identify_the_chain():
    record = printed_record()
    counts = {name: int(np.isfinite(values).sum()) for name, values in record.outputs.items()}
    assert counts == {"y1": 3, "v1": 4, "y2": 23, "v2": 34, "y3": 20, "v3": 17}
    result = fit(read_ode_model(FOLDER / "three_masses" / "model.toml"), record)
    shown = [
        f"{value:.{n}f} ± {std:.{n}f}"
        for value, std, n in zip(result.values, result.std, (5, 4, 5), strict=True)
    ]
    assert shown == ["0.13994 ± 0.00014", "11.9988 ± 0.0028", "27.99998 ± 0.00003"]
    chi2 = result.estimate.residuals @ result.estimate.residuals
    assert len(result.estimate.residuals) == 101 - 6  # known initial values fix the first of each
    assert round(float(chi2)) == 97


def test_the_record_of_f_agrees_with_every_intact_printed_value():
    table = pd.read_csv(PRINTED, comment="#")
    record = read_record(
        FOLDER / "three_masses" / "record.csv", read_ode_model(FOLDER / "three_masses" / "model.toml")
    )
    for row in table.itertuples():
        assert record.outputs[row.state][round(row.t_s / 0.2)] == row.value


@pytest.mark.parametrize("method", METHODS)
def test_f_with_every_method(cli, method):
    folder = FOLDER / "three_masses"
    found = cli("fit", folder / "model.toml", folder / "record.csv", "--method", method, "--json").json
    assert found["method"] == method
    values = np.array([entry["value"] for entry in found["parameters"].values()])
    std = np.array([entry["std"] for entry in found["parameters"].values()])
    np.testing.assert_allclose(values, [0.13999975, 11.99998962, 28.00000273], rtol=1e-7)
    np.testing.assert_allclose(std, [5.6e-7, 1.2e-5, 1.0e-5], rtol=0.05)
    if method in ("gauss-newton", "quasilinearization"):
        assert found["iterations"] <= 6


def test_q_with_an_accurate_integrator_finds_the_truth(cli):
    folder = FOLDER / "quasilinearization"
    found = cli(
        "fit", folder / "model.toml", folder / "record.csv", "--method", "quasilinearization", "--json"
    ).json
    values = [entry["value"] for entry in found["parameters"].values()]
    np.testing.assert_allclose(values, [1, -1, -1], rtol=0, atol=1e-8)


TABLE_2_3 = np.array(
    [
        [-0.1849, -2.058, 1.139],
        [-0.2652, -0.3099, -1.54],
        [0.4036, -1.281, -1.019],
        [0.8887, -1.028, -0.9184],
        [0.9982, -1.0, -0.9968],
        [0.9986, -1.001, -0.9981],
    ]
)
HALF_A_UNIT = 0.5 * 10.0 ** (np.floor(np.log10(np.abs(TABLE_2_3))) - 3)


def test_q_with_its_own_scheme_repeats_table_2_3(cli):
    """Half a unit of four digits, but for two numbers of the ill-conditioned second iteration."""
    folder = FOLDER / "quasilinearization"
    options = ("--method", "quasilinearization", "--integrator")
    misses = {}
    for integrator in ("sequential-heun", "heun"):
        command = ("fit", folder / "model.toml", folder / "record.csv", *options, integrator, "--json")
        found = cli(*command).json
        assert found["integrator"] == integrator
        assert any("more accurate integration would change theta1" in text for text in found["warnings"])
        history = np.array([list(step["parameters"].values()) for step in found["history"][:7]])
        assert history[0].tolist() == [0, 0, 0]
        misses[integrator] = np.abs(history[1:] - TABLE_2_3) / HALF_A_UNIT
    beyond = np.argwhere(misses["sequential-heun"] > 1).tolist()
    assert beyond == [[1, 0], [1, 1]]
    assert misses["sequential-heun"].max() < 2.4
    assert (misses["heun"] > 1).sum() == 13


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
