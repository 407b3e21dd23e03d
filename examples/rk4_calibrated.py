"""The rig of `rk4.py` with a model: what three runs tell of it, and what it then tells of other runs.

Run `python examples/rk4_calibrated.py`. `BASE`, `A007` and `A015` calibrate `sample_data/rk4/rotor.toml`, at
both speeds or at one. Its coefficients, and those of the trial runs for comparison, estimate the weights of
the other eight runs at either speed, none of which calibrated anything.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import balancing
import fem
from rotorid import read_job, read_rotor
from rotorid.calibration import CalibratedRotor
from rotorid.commands.calibrate import CalibrateOptions, calibrate
from rotorid.commands.choice_of_coefficients import choose

sys.path.insert(0, str(Path(__file__).parent))
from rk4 import BARE, FEW, FOLDER, estimated, lines, of

JOBS = {1206: ("few.toml", "job.toml"), 1005: ("few_1005.toml", "job_1004.toml")}
BOTH = (1206, 1005)
BEARINGS = {480: (3, 27), 520: (2, 28), 560: (1, 29)}  # mm between them, nodes
BELIEVED = ((480, 1e6), (480, 7e4), (520, 1e6), (560, 2e5), (560, 1e6))  # mm, N/m
PROBES = ("p1x", "p1y", "p2x", "p2y")
OF = ("disk_1", "disk_2", "sum")
ESTIMATE = (
    "bearing.kxx, bearing.kyy, bearing.cxx, bearing.cyy, bearing.tilting_stiffness, "
    "key_phasor.angle, probe[*].gain"
)
PRIOR = (
    "bearing.k*=40%, bearing.c*=40%, bearing.tilting_stiffness=100%, "
    "key_phasor.angle=0+-100, probe[*].gain=50%, probe[*].angle=0+-30"
)


def main() -> dict[str, float]:
    """Print what the trial runs say of the rotor, and how well it estimates weights; return key numbers."""
    rotors = {BOTH: beliefs()[560, 1e6], **{(rpm,): calibration((rpm,)).rotor for rpm in BOTH}}
    for rpm in BOTH:
        print(f"\nWeights at {rpm} rpm by the calibrated rotor (error, half the longest axis of its region):")
        coefficients = known(rpm, "computed", rotors[BOTH])
        lines({run: (coefficients, one) for run, one in others(rpm).items()}, "weighted")
    numbers: dict[str, float] = {}
    for method in ("weighted", "least-squares"):
        print(f"\nError ± half axis, root mean square over these eight runs, --method {method} (g·mm):")
        for rpm in BOTH:
            errors = summary(rpm, rotors, method)
            for kind in ("both", "other") if method == "weighted" else ():
                numbers |= {
                    f"{kind}_{rpm}_{name}": float(e) for name, e in zip(OF, errors[kind], strict=True)
                }
    return numbers


def beliefs() -> dict[tuple[float, float], fem.Rotor]:
    """Print what the runs at both speeds say of other distances and stiffnesses; return the rotors."""
    rotors = {}
    print("Bearings           χ² (dof)    critical speeds     gains of", ", ".join(PROBES))
    for span, stiffness in BELIEVED:
        found = calibration(BOTH, span, stiffness)
        rotors[span, stiffness] = found.rotor
        first, second = fem.critical_speeds(found.rotor, 2).frequencies * 30 / np.pi
        values = dict(zip(found.names, found.values, strict=True))
        gains = ", ".join(f"{values[f'probe[{name}].gain']:.2f}" for name in PROBES)
        verdict = "" if found.explained else "  contradicted by the runs"
        critical = f"{first:.0f} and {second:.0f} rpm"
        fit = f"{found.chi_square:.1f} ({found.dof})"
        print(f"  {span} mm, {stiffness:.0e} N/m  {fit}  {critical}  {gains}{verdict}")
    return rotors


def calibration(speeds: Sequence[int], span: int = 560, stiffness: float = 1e6) -> CalibratedRotor:
    """The rotor of the sample with bearings believed to be so, calibrated at these speeds."""
    start = read_rotor(FOLDER / "rotor.toml")
    bearings = zip(start.supports, BEARINGS[span], strict=True)
    start = replace(start, supports=[replace(s, node=node, stiffness=stiffness) for s, node in bearings])
    files = [FOLDER / JOBS[rpm][0] for rpm in speeds]
    return calibrate(start, files, CalibrateOptions(estimate=ESTIMATE, prior=PRIOR)).result


def known(rpm: int, kind: str, rotor: fem.Rotor | None = None) -> balancing.Influence:
    """Coefficients at a speed, measured, computed or combined, with the bare rotor's vibration."""
    job = read_job(FOLDER / JOBS[rpm][0])
    found = choose(job if rotor is None else replace(job, rotor=rotor), kind)[0]
    return found if found.has_baseline else found.rebased(of(job.trials, [BARE]))


def others(rpm: int) -> dict[str, balancing.Trials]:
    """The runs that calibrate nothing, with phases and angles as in the jobs that calibrate."""
    trials = read_job(FOLDER / JOBS[rpm][1], phase="lag", angles="against rotation").trials
    return {run: of(trials, [run]) for run in trials.runs if run not in FEW}


def summary(
    rpm: int, rotors: dict[tuple[int, ...], fem.Rotor], method: str
) -> dict[str, NDArray[np.float64]]:
    """Print one line for each kind of coefficients; return their errors of disc 1, disc 2 and the sum."""
    (other,) = {*BOTH} - {rpm}
    kinds = {
        "plain": ("of the trial runs", known(rpm, "measured")),
        "both": ("of the rotor calibrated at both", known(rpm, "computed", rotors[BOTH])),
        "own": (f"of that calibrated at {rpm}", known(rpm, "computed", rotors[rpm,])),
        "other": (f"of that calibrated at {other}", known(rpm, "computed", rotors[other,])),
        "combined": (f"of this and the trial runs at {rpm}", known(rpm, "combined", rotors[other,])),
    }
    runs, errors = others(rpm).values(), {}
    print(
        f"  {rpm} rpm, coefficients               disk 1         disk 2         sum of both    held   silent"
    )
    for kind, (words, coefficients) in kinds.items():
        found = [estimated(coefficients, one, method) for one in runs]
        errors[kind], size = (
            np.sqrt(np.mean(np.square([getattr(each, name) for each in found]), axis=0))
            for name in ("errors", "sizes")
        )
        cells = "  ".join(f"{e:5.2f} ± {s:5.2f}" for e, s in zip(errors[kind], size, strict=True))
        held = " ".join(map(str, np.sum([each.inside for each in found], axis=0)))
        print(f"  {words:34}  {cells}  {held}   {sum(not each.warned for each in found)}")
    return errors


if __name__ == "__main__":
    main()
