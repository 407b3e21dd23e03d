"""A rotor in journal bearings as three masses: what holds it, when it whips, and a run-up.

Run `python examples/reduce_and_run_up.py`; at the first time numba compiles for half a minute, and without it
(`pip install "rotorid[fast]"`) all takes some hundred times longer.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rotorid.commands.bearings import BearingsOptions, bearings
from rotorid.files import read_rotor
from rotorid.motion.equilibrium import at_rest, equilibrium
from rotorid.motion.periodic import periodic_motion
from rotorid.motion.run import run
from rotorid.motion.steady import steady_end
from rotorid.motion.system import rotor_system
from rotorid.reduction import held_rigidly, keep_supports, reduce

ROTOR = Path(__file__).parents[1] / "sample_data" / "motion" / "rotor.toml"
RPM = np.pi / 30
NODES = (7, 12, 18)
UNBALANCE = {7: 1e-3, 18: 1e-3 * np.exp(2j * np.pi / 3)}  # kg·m


def main() -> dict[str, float]:
    """Print the way from the shaft to the motion; return its key numbers."""
    # Masses by formula (50) on rigid supports; the journal bearings stay.
    rotor = read_rotor(ROTOR)
    masses = reduce(held_rigidly(rotor), NODES, 2).masses.solution
    small = keep_supports(rotor, NODES, masses)
    print(small.summary(), end="\n\n")

    # The bearings carry what they carry in the whole rotor, and it loses stability where that does.
    whole = bearings(rotor, BearingsOptions(speeds="5000:8000:1000rpm")).result
    system = rotor_system(small, 500 * RPM, 9000 * RPM)
    resting = equilibrium(system, 5000 * RPM)
    loads = np.abs(resting.load), np.abs(whole.equilibria[0].load)
    print("loads in N, of the small model and of the rotor:", *(np.round(load, 3) for load in loads))
    (lost,) = periodic_motion(system, 5000 * RPM, 8000 * RPM).branches[0].bifurcations
    assert whole.stability is not None
    thresholds = lost.speed / RPM, (whole.stability.threshold or np.nan) / RPM
    print("stable up to {:.1f} rpm; the rotor up to {:.1f} rpm".format(*thresholds), end="\n\n")

    # Half a percent of external damping moves the threshold far up. There a limit cycle begins.
    damped = keep_supports(rotor, NODES, masses, modal_damping=[0.005] * 3)
    system, speed = rotor_system(damped, 500 * RPM, 13000 * RPM), 9000 * RPM
    rest, cycle, *_ = periodic_motion(system, 11000 * RPM, 13000 * RPM, limit_cycle=True).branches
    (lost,) = rest.bifurcations
    print(f"with 0.5 % of damping: stable up to {lost.speed / RPM:.0f} rpm; its limit cycle:")
    for orbit in cycle.bifurcations:
        whirl = 2 * np.pi / orbit.period / orbit.speed
        print(f"  {orbit.bifurcation} at {orbit.speed / RPM:.0f} rpm, whirl at {whirl:.3f} of the speed")

    # And yet, far below, a push makes it whip.
    whirls = []
    for push in (0.1e-3, 0.5e-3):
        q = at_rest(system, speed)
        for node in (7, 12, 18):
            q[system.index(node)[0]] += push
        end = steady_end(run(system, (speed, speed), 20.0, (q, np.zeros_like(q))))
        whirls.append(end)
        size = 1e3 * end.amplitude[2]
        print(f"pushed by {1e3 * push:.1f} mm at 9000 rpm: at its middle {size:.3f} mm after 20 s")
    whip = whirls[1].frequency / RPM, whirls[1].eccentricity[0, 1]
    print("it whips at {:.0f} rpm, its journals up to {:.2f} of their clearance".format(*whip), end="\n\n")

    # Run-up through both critical speeds.
    system = rotor_system(damped, 500 * RPM, 7000 * RPM, unbalance=UNBALANCE)
    q = at_rest(system, 600 * RPM)
    motion = run(system, (600 * RPM, 6200 * RPM), 10.0, (q, np.zeros_like(q)))
    peaks = {}
    for low, high in ((800, 2000), (4500, 6000)):
        there = (motion.speed > low * RPM) & (motion.speed < high * RPM)
        swing = motion.z[there].imag - np.median(motion.z[there].imag, axis=0)
        at, node = np.unravel_index(np.argmax(np.abs(swing)), swing.shape)
        peaks[low] = motion.speed[there][at] / RPM, 1e6 * abs(swing[at, node])
        print(f"largest at {peaks[low][0]:.0f} rpm: {peaks[low][1]:.0f} µm at node {motion.nodes[node]}")
    speed = 5400 * RPM
    q = at_rest(system, speed)
    end = steady_end(run(system, (speed, speed), 30.0, (q, np.zeros_like(q))))
    print(f"staying at 5400 rpm: {1e3 * end.amplitude[3]:.1f} mm at node 18 after 30 s")
    return {
        "mass_kg": float(small.masses.sum()),
        "load_N": float(loads[0][0]),
        "threshold_rpm": round(float(thresholds[0]), 1),
        "rotor_threshold_rpm": round(float(thresholds[1]), 1),
        "damped_threshold_rpm": round(float(lost.speed / RPM), 1),
        "whip_rpm": round(float(whip[0])),
        "whip_eccentricity": round(float(whip[1]), 2),
        "first_critical_rpm": round(float(peaks[800][0])),
        "second_critical_rpm": round(float(peaks[4500][0])),
    }


if __name__ == "__main__":
    main()
