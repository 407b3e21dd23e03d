"""Write the measurement tables of this folder: `python make_data.py` (needs NumPy only, not rotorid).

Amplitudes are computed from the equations as typed here, independently of the program, and rounded to two
significant digits as the book does (section 2.5); `data_exact.csv` holds all digits. Tables of tasks with
printed data are written with the printed numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
Amplitudes = dict[str, complex]
Model = Callable[[complex], Amplitudes]


def two_digits(x: float) -> float:
    """Rounded to two significant digits."""
    return float(f"{x:.1e}")


def all_digits(x: float) -> float:
    """As it is."""
    return float(x)


def write(folder: str, model: Model, frequencies: list[float], exact: bool = False) -> None:
    """Tables of real and imaginary parts."""
    for name, rounded in [("data.csv", two_digits), *([("data_exact.csv", all_digits)] if exact else [])]:
        lines = []
        for w in frequencies:
            z = model(1j * w)
            if not lines:
                parts = [f"{s}_{part}" for s in z for part in ("re", "im")]
                lines.append(",".join(["frequency_rad_s", *parts]))
            cells = [w, *(rounded(x) for value in z.values() for x in (np.real(value), np.imag(value)))]
            lines.append(",".join(repr(float(x) + 0.0) for x in cells))
        save(folder, name, lines)


def save(folder: str, name: str, lines: list[str]) -> None:
    """One file."""
    (HERE / folder).mkdir(exist_ok=True)
    (HERE / folder / name).write_text("\n".join(lines) + "\n", encoding="utf-8")


def two_masses(p: complex) -> Amplitudes:
    """Task 1.1, fig. 7: masses in a chain, dampers a1, a12, a2."""
    m1, m2, c1, c2, a1, a12, a2, F = 10.0, 5.0, 1e4, 5e3, 20.0, 30.0, 10.0, 100.0
    A = [
        [m1 * p**2 + (a1 + a12) * p + c1 + c2, -a12 * p - c2],
        [-a12 * p - c2, m2 * p**2 + (a2 + a12) * p + c2],
    ]
    X1, X2 = np.linalg.solve(A, [F, 0])
    return {"F": F, "X1": X1, "X2": X2}


def third_order(p: complex) -> Amplitudes:
    """Task 2.1."""
    a1, a2, a3, F = 2.0, 10.0, 8.0, 1.0
    return {"F": F, "X": F / (p**3 + a1 * p**2 + a2 * p + a3)}


def servo(p: complex) -> Amplitudes:
    """Tasks 2.2 and 2.3, fig. 8 (also section 1.8 and lesson 6)."""
    T0, T1, T2, K, F = 1.0, 0.5, 0.8, 10.0, 1.0
    below = T0 * T1 * T2 * p**3 + (T0 + T1) * T2 * p**2 + T2 * p + K
    return {"F": F, "S": (T1 * T2 * p**2 + T2 * p) * F / below}


def three_lags(p: complex) -> Amplitudes:
    """Tasks 3.1 to 3.3, fig. 9."""
    T0, T1, T2, K, F = 1.0, 0.2, 0.8, 10.0, 1.0
    below = T0 * T1 * T2 * p**3 + (T0 * T1 + T0 * T2 + T1 * T2) * p**2 + (T0 + T1 + T2) * p + 1 + K
    return {"F": F, "S": (T1 * T2 * p**2 + (T1 + T2) * p + 1) * F / below}


def pump_rotor(p: complex) -> Amplitudes:
    """Task 4.1: one mass, circulating force q = delta*b*omega."""
    m, c, b, delta, e = 10.0, 1e5, 1e4, 0.5, 1e-4
    return {"Z": -m * e * p**2 / (m * p**2 + b * p + c - delta * b * p)}


def balance_drum(p: complex) -> Amplitudes:
    """Tasks 4.2 and 4.3, fig. 10."""
    T0, T1, T2, zeta, K, F = 0.5, 0.2, 0.8, 0.3, 2.0, 1.0
    below = T0**2 * T2 * p**3 + T0 * (2 * zeta * T2 + T0) * p**2 + (2 * zeta * T0 + K * T1 + T2) * p + 1 + K
    return {"F": F, "S": (T2 * p + 1) * F / below}


def coupled_masses(p: complex) -> Amplitudes:
    """Section 1.6: two masses with full matrices."""
    m1, m2, c1, c, c2, alpha1, alpha, alpha2, F1 = 10.0, 20.0, 1.5e4, -5e3, 1.2e4, 50.0, -15.0, 40.0, 100.0
    A = [
        [m1 * p**2 + alpha1 * p + c1, alpha * p + c],
        [alpha * p + c, m2 * p**2 + alpha2 * p + c2],
    ]
    X1, X2 = np.linalg.solve(A, [F1, 0])
    return {"F1": F1, "X1": X1, "X2": X2}


def write_rotor() -> None:
    """Section 1.7: amplitude and phase of a whirling rotor, seen in two directions."""
    m, c, b, q, e = 10.0, 1e5, 2e2, 5e3, 1e-4
    head = "speed_rad_s," + ",".join(f"{s}_amplitude,{s}_phase_deg" for s in ("Ux", "Uy", "X", "Y"))
    for name, exact in (("data.csv", False), ("data_exact.csv", True)):
        lines = [head]
        for w in (60.0, 90.0, 110.0, 140.0):
            Z = m * e * w**2 / (c - m * w**2 + 1j * (b * w - q))
            size, phase = float(np.abs(Z)), float(np.degrees(np.angle(Z)))
            size, phase = (size, phase) if exact else (two_digits(size), round(phase))
            other = phase - 90.0 if phase - 90.0 >= -180.0 else phase + 270.0
            lines.append(f"{w!r},{m * e!r},0,{m * e!r},-90,{size!r},{phase!r},{size!r},{other!r}")
        save("section_1_7", name, lines)


def write_printed() -> None:
    """Tables that the book prints."""
    save(
        "task_5_1",
        "data.csv",
        ["frequency_rad_s,F_re,X_re,X_im", "10,10,0,-0.1", "20,10,-3.3e-3,-2.2e-4", "30,10,-1.2e-3,-4.7e-5"],
    )
    save("task_5_2", "data.csv", ["speed_rad_s,Z_re,Z_im", "80,1.43e-6,-16e-6", "100,0,-20e-6"])
    feedback = ["frequency_rad_s,F_re,S_re,S_im", "1,1,-0.041,0.093", "2,1,-0.37,0.20"]
    for folder in ("task_6_1", "task_6_2"):
        save(folder, "data.csv", feedback)
    save(
        "section_1_8",
        "data.csv",
        [
            "# the printed K and Y of section 1.8, each two real rows as one complex row",
            "frequency_rad_s,k1_re,k1_im,k2_re,k2_im,y_re,y_im",
            "1,-0.052,-1.1,1.1,-0.052,0.41,-0.93",
            "2,1.1,-3.5,7.0,2.2,3.7,-2.0",
        ],
    )


def write_chain() -> None:
    """Tasks 7.1 and 7.2: natural frequencies at rounded z, shapes from the last two equations at these z."""
    m2, m3, c2, c3 = 20.0, 10.0, 2e4, 5e3
    lines = ["frequency_rad_s,X1_re,X2_re,X3_re"]
    for z in (150.0, 690.0, 2400.0):
        A = [[-m2 * z + c2 + c3, -c3], [-c3, -m3 * z + c3]]
        A2, A3 = np.linalg.solve(A, [c2, 0.0])
        lines.append(f"{float(np.sqrt(z))!r},1,{float(A2)!r},{float(A3)!r}")
    for folder in ("task_7_1", "task_7_2"):
        save(folder, "data.csv", lines)
    digits = ["1.346,1.923", "0.821,-2.161", "-0.922,0.243"]
    rows = [f"{float(np.sqrt(z))!r},1,{d}" for z, d in zip((150.0, 690.0, 2400.0), digits, strict=True)]
    save("task_7_2", "data_three_digits.csv", [lines[0], *rows])


def write_beam() -> None:
    """Tasks 8.1 and 8.2: printed z and shapes."""
    rows = [f"{float(np.sqrt(z))!r},1,{a}" for z, a in ((2.183e6, 1.208), (4.581e7, -0.414))]
    for folder in ("task_8_1", "task_8_2"):
        save(folder, "data.csv", ["frequency_rad_s,X1_re,X2_re", *rows])


if __name__ == "__main__":
    write("task_1_1", two_masses, [25.0, 45.0], exact=True)
    write("task_1_2", two_masses, [25.0, 45.0], exact=True)
    write("task_2_1", third_order, [1.0, 2.0, 4.0], exact=True)
    write("task_2_2", servo, [1.0, 2.0, 3.0], exact=True)
    write("task_2_3", servo, [1.0, 2.0, 3.0], exact=True)
    write("task_3_1", three_lags, [1.0, 2.0, 4.0], exact=True)
    write("task_3_2", three_lags, [1.0, 2.0, 4.0], exact=True)
    write("task_3_3", three_lags, [0.5, 1.0, 2.0, 4.0, 8.0], exact=True)
    write("task_4_1", pump_rotor, [80.0, 100.0, 120.0], exact=True)
    write("task_4_2", balance_drum, [1.0, 2.0, 4.0], exact=True)
    write("task_4_3", balance_drum, [0.5, 1.0, 2.0, 4.0], exact=True)
    write("section_1_6", coupled_masses, [20.0, 30.0, 45.0], exact=True)
    write_rotor()
    write_printed()
    write_chain()
    write_beam()
