"""Run-ups of drawn rotors, by the example, and their tables as people write them."""

import coverage_runup as example
import numpy as np

from rotorid.base.text import RPM


def drawn(seed=5, rate=100.0, noise=1e-6):
    """A rotor and the vectors of its sweep, rate in rpm a second."""
    random = np.random.default_rng(seed)
    rotor = example.draw_rotor(random)
    return rotor, example.draw_sweep(random, rotor, rate / RPM, noise)


def table(path, sweeps, *, lag=False, time=True):
    """Write a table of vectors; angles as lags where asked for."""
    head = "run,speed_rpm,sensor,amplitude_um_pp,phase_deg"
    head += ",time_s" if time else ""
    lines = [
        head
        + ",amplitude_std_um_pp,phase_std_deg,turns,overall_um,gap_V,order2_amplitude_um,order2_phase_deg"
    ]
    for sweep in sweeps:
        for i, c in np.ndindex(sweep.vectors.shape):
            z, sd = sweep.vectors[i, c], np.sqrt(sweep.covariances[i, c, 0, 0])
            cells = [sweep.run, sweep.speeds[i] * RPM, sweep.sensors[c], 2e6 * abs(z)]
            cells.append(np.degrees(np.angle(z)) * (-1 if lag else 1))
            cells += [sweep.time[i]] if time else []
            cells += [2e6 * sd, np.degrees(sd / abs(z))]
            lines.append(
                ",".join(f"{x:.12g}" if isinstance(x, float) else str(x) for x in [*cells, 8, 1, 9, 1, 0])
            )
    path.write_text("\n".join(lines) + "\n")
    return path
