"""The picture of modes holds the readings and the closed form that they were drawn from, in their units."""

import numpy as np
from documents import check_hygiene

from rotorid.commands.modes import ModesOptions, modes

M = np.diag([20.0, 20.0, 10.0])
K = np.array([[3e4, -2e4, 0.0], [-2e4, 2.5e4, -5e3], [0.0, -5e3, 5e3]])
OMEGA = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real))


def around(share=4e-4, readings=9, modes=3):
    return np.concatenate([w * (1 + 3 * share * w / 2 * np.linspace(-1, 1, readings)) for w in OMEGA[:modes]])


def response(omega, force=(0.0, 0.0, 10.0)):
    """Of the chain of task 7.1, frequency by frequency."""
    return np.array([np.linalg.solve(K - w**2 * M + 4e-4j * w * K, force) for w in np.atleast_1d(omega)])


def written(path, omega, Z, unit="um", scale=1e6, F=None, names=()):
    names = names or [f"X{p + 1}" for p in range(Z.shape[1])]
    head = ["frequency_Hz", *["F_re", "F_im"] * (F is not None)]
    head += [f"{name}_{part}_{unit}" for name in names for part in ("re", "im")]
    rows = [",".join(head)]
    for i, (w, z) in enumerate(zip(omega / 2 / np.pi, scale * Z, strict=True)):
        cells = [w, *([] if F is None else [F[i].real, F[i].imag]), *np.stack((z.real, z.imag), 1).ravel()]
        rows.append(",".join(repr(float(cell)) for cell in cells))
    path.write_text("\n".join(rows))
    return path


def drawn(path, excitation="force", **options):
    """The figure, and its axes, two a mode."""
    figure = modes(path, ModesOptions(excitation=excitation, **options)).figure()
    check_hygiene(figure)
    return figure, np.array(figure.axes).reshape(-1, 2)


def points(ax):
    """Hollow marks, one array (n, 2) a point."""
    found = [line for line in ax.lines if line.get_marker() != "None"]
    assert all(line.get_markerfacecolor() == "none" and line.get_linestyle() == "None" for line in found)
    return [line.get_xydata() for line in found]


def curves(ax):
    return [line.get_xydata() for line in ax.lines if len(line.get_xydata()) > 500]


def test_readings_and_curves_are_those_of_the_chain_in_the_units_of_the_table(tmp_path):
    omega = around()
    _, axes = drawn(written(tmp_path / "a.csv", omega, response(omega)))
    for mode, (circle, peak) in enumerate(axes):
        near = omega[9 * mode : 9 * mode + 9]
        assert circle.get_aspect() == 1.0
        assert circle.get_xlabel() == "real part, µm peak"
        assert circle.get_ylabel() == "imaginary part, µm peak"
        assert (peak.get_xlabel(), peak.get_ylabel()) == ("frequency, Hz", "amplitude, µm peak")
        for p, (read, sizes, loop, top) in enumerate(
            zip(points(circle), points(peak), curves(circle), curves(peak), strict=True)
        ):
            exact = 1e6 * response(near)[:, p]
            np.testing.assert_allclose(read @ (1, 1j), exact, rtol=1e-9)
            np.testing.assert_allclose(sizes, np.stack((near / 2 / np.pi, np.abs(exact)), 1), rtol=1e-9)
            between = 1e6 * response(2 * np.pi * top[:, 0])[:, p]
            np.testing.assert_allclose(loop @ (1, 1j), between, atol=1e-3 * np.abs(between).max())
            np.testing.assert_allclose(top[:, 1], np.abs(between), atol=1e-3 * np.abs(between).max())


def test_an_unbalance_grows_between_readings_with_the_square_of_the_speed(tmp_path):
    def shaken(w):
        """A mass on a spring with 5 % of critical damping, and half of that."""
        return np.outer(w**2 / (144 - w**2 + 1.2j * w), [1.0, 0.5])

    omega = np.linspace(9.0, 16.0, 15)
    _, axes = drawn(written(tmp_path / "a.csv", omega, shaken(omega)), "unbalance", bands=[(8.0, 17.0)])
    assert len(curves(axes[0, 1])) == 2
    for p, top in enumerate(curves(axes[0, 1])):
        between = 1e6 * np.abs(shaken(2 * np.pi * top[:, 0])[:, p])
        np.testing.assert_allclose(top[:, 1], between, rtol=1e-6)
