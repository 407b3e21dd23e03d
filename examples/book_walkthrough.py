"""The three references in their own order, with their numbers and errata; docs/book has a page a chapter.

[S] is V. I. Simonovskiy's book on estimating coefficients of models of oscillating systems, [Q] a guide to
quasilinearization, [F] one to sensitivity functions. Run `python examples/book_walkthrough.py`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import balancing
import fem
import rotorid

SAMPLES = Path(__file__).parents[1] / "sample_data"


def _task(name: str, data: str = "data.csv") -> rotorid.Identification:
    """One exercise of [S] from its files."""
    folder = SAMPLES / "identify" / name
    model = rotorid.read_harmonic_model(folder / "model.toml")
    return rotorid.identify(model.model, rotorid.read_measurements(folder / data, model))


def _values(found: rotorid.Identification) -> dict[str, float]:
    return {name: float(value) for name, value in zip(found.parameters, found.values, strict=True)}


def forced_vibration() -> dict[str, float]:
    """[S] 1.6 to 1.8: complex equations become real ones, K θ = Y."""
    print("[S] 1.6: three dampers of two coupled masses from four amplitudes")
    dampers = _values(_task("section_1_6", "data_exact.csv"))
    print("  ", ", ".join(f"{name} = {value:.6g} kg/s" for name, value in dampers.items()))
    print("[S] 1.8: the printed K and Y of a feedback system, T2 and T1 T2, stretched into real rows")
    K = np.array([[-0.052 - 1.1j, 1.1 - 0.052j], [1.1 - 3.5j, 7.0 + 2.2j]])
    Y = np.array([0.41 - 0.93j, 3.7 - 2.0j])
    found = rotorid.least_squares(rotorid.stretch(K)[:, ::2], rotorid.stretch(Y), names=["T2", "T1*T2"])
    print(f"   T2 = {found.values[0]:.3f}, T1 T2 = {found.values[1]:.3f}")
    return {"1.6 alpha1": dampers["alpha1"], "1.8 T2": found.values[0], "1.8 T1*T2": found.values[1]}


def _corrections(found: balancing.Correction) -> dict[str, Any]:
    """Print a correction; return its first plane."""
    rows = found.to_dict()["corrections"]
    for row in rows:
        unit = row["unit"].replace("_", "·")
        print(f"   plane {row['plane']}: {row['mass']:.4g} {unit} at {row['angle_deg']:.1f}°")
    return dict(rows[0])


def balancing_a_rotor() -> dict[str, float]:
    """[S] 1.9: influence coefficients, Y = W D; the correction stands opposite to D."""
    print("[S] 1.9: two planes of a rigid rotor (the example of Brüel & Kjær)")
    job = rotorid.read_job(SAMPLES / "bk_two_plane" / "job.toml")
    correction = balancing.correct(balancing.estimate_influence(job.trials))
    first = _corrections(correction)
    print("[S] 1.9.3: Den Hartog's method, three planes, four probes, five speeds around two critical ones")
    job = rotorid.read_job(SAMPLES / "turbo_job" / "job.toml")
    left = _corrections(balancing.correct(balancing.estimate_influence(job.trials), method="least-squares"))
    return {
        "1.9 mass": first["mass"],
        "1.9 angle": first["angle_deg"],
        "1.9.3 mass": left["mass"],
        "1.9.3 angle": left["angle_deg"],
    }


def lessons_1_to_6() -> dict[str, float]:
    """[S] lessons 1 to 6: coefficients from amplitudes; some of the exercises cannot be solved as printed."""
    print("[S] 5.1: one mass (the printed formula for Im X has m where ω belongs)")
    one = _values(_task("task_5_1"))
    print(f"   c = {one['c']:.3f} N/m, alpha = {one['alpha']:.3f} N·s/m")
    print("[S] 4.1: the columns of b and delta b are opposite, so the exercise is singular:")
    singular = _task("task_4_1", "data_exact.csv")
    print("  ", "; ".join(singular.unidentifiable))
    print("[S] 6.1: a feedback system (the table prints -0.31 where the calculation has -0.37)")
    feedback = _values(_task("task_6_1"))
    print(f"   T2 = {feedback['T2']:.3f}, T1 T2 = {feedback['T1'] * feedback['T2']:.3f}")
    return {"5.1 c": one["c"], "5.1 alpha": one["alpha"], "4.1 rank": singular.rank, "6.1 T2": feedback["T2"]}


def lessons_7_and_8() -> dict[str, float]:
    """[S] lessons 7 and 8: stiffnesses from natural frequencies and shapes."""
    print("[S] 7.1: a chain of three masses (c3 is 5e3 N/m, printed as 5e4)")
    chain = _values(_task("task_7_1"))
    print("  ", ", ".join(f"{name} = {value:.1f}" for name, value in chain.items()))
    print("[S] 8.1: a beam with two masses in compliance form (the formula of δ12 is 8 times too large)")
    beam = _values(_task("task_8_1"))
    print("  ", ", ".join(f"{name} = {value:.4g}" for name, value in beam.items()))
    return {"7.1 c1": chain["c1"], "7.1 c3": chain["c3"], "8.1 c1": beam["c1"], "8.1 c2": beam["c2"]}


def equivalent_masses() -> dict[str, float]:
    """[S] 1.10, tasks 9.1 and 9.2: a rotor of 23 elements as three masses, formula (50)."""
    print(
        "[S] 9.1: critical speeds of the rotor (two rows of the printed table are missing: 8 and 9 equal 10)"
    )
    rotor = rotorid.read_rotor(SAMPLES / "rotor23.csv")
    speeds = fem.critical_speeds(rotor, 3).frequencies
    print("  ", ", ".join(f"{speed:.5f}" for speed in speeds), "rad/s")
    out = {f"rotor omega{i + 1}": float(speed) for i, speed in enumerate(speeds)}
    for suffix, words in (
        ("_printed", "modes and α as printed"),
        ("", "modes and α with all digits (α12 is printed 1.3 % too high)"),
    ):
        modes = rotorid.read_modes(SAMPLES / "book_task_9" / f"modes{suffix}.csv")
        _, alpha = rotorid.read_compliance(SAMPLES / "book_task_9" / f"compliance{suffix}.csv", modes.nodes)
        for n in (1, 2):
            found = rotorid.equivalent_masses(alpha, modes.frequencies[:n], modes.shapes[:, :n])
            second = rotorid.natural_frequencies(alpha, found.values)[0][1]
            m = ", ".join(f"{mass:.3f}" for mass in found.values)
            print(f"   {words}, first {n}: masses {m} kg, second frequency {second:.2f} rad/s")
            out |= {f"9.{n}{suffix} m1": found.values[0], f"9.{n}{suffix} omega2": second}
    print(
        "   so the second frequency of one mode is 1.9 % too low, and not 10 % too high as the book concludes"
    )
    return out


def records() -> dict[str, float]:
    """[Q] and [F]: parameters of differential equations from records."""
    out: dict[str, float] = {}
    for name, method, words in (
        (
            "quasilinearization",
            "quasilinearization",
            "[Q]: the truth is (1, -1, -1), its signs lost in the print",
        ),
        (
            "three_masses",
            "gauss-newton",
            "[F]: the printed record is damaged, its intact part gives (0.14, 12, 28)",
        ),
    ):
        folder = SAMPLES / "fit" / name
        model = rotorid.read_ode_model(folder / "model.toml")
        found = rotorid.fit(model, rotorid.read_record(folder / "record.csv", model), method=method)
        print(words)
        print("  ", ", ".join(f"{p} = {v:.8g}" for p, v in zip(found.parameters, found.values, strict=True)))
        out |= {p: float(v) for p, v in zip(found.parameters, found.values, strict=True)}
    return out


def main() -> dict[str, float]:
    """Print all sections; return their numbers."""
    sections = (
        forced_vibration, balancing_a_rotor, lessons_1_to_6, lessons_7_and_8, equivalent_masses, records,
    )  # fmt: skip
    out: dict[str, float] = {}
    for section in sections:
        out |= section()
        print()
    return {key: float(value) for key, value in out.items()}


if __name__ == "__main__":
    main()
