"""Dampers and a mass of a rotor from its decay after a blow, and whether the fit may be believed.

Run `python examples/fit_a_record.py [PICTURE.png]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rotorid import fit, read_ode_model, read_record
from rotorid.plots import plot

FOLDER = Path(__file__).parents[1] / "sample_data" / "fit" / "run_down"
TRUTH = {"d_x7": 900.0, "d_x12": 1600.0, "d_x18": 1300.0, "m_x12": 196.617, "blow": 0.05}


def main(picture: str | None = None) -> dict[str, float]:
    """Print estimates and intervals; return them."""
    model = read_ode_model(FOLDER / "model.toml")
    record = read_record(FOLDER / "record.csv", model)
    found = fit(model, record)
    print(found.summary(), end="\n\n")
    assert found.ci95 is not None
    assert found.std is not None

    # The record is simulated: the truth is known, and should lie in most of the intervals.
    for name, (low, high) in zip(found.parameters, found.ci95, strict=True):
        where = "inside" if low <= TRUTH[name] <= high else "outside"
        print(f"{name:6} true {TRUTH[name]:10.6g} {where} {low:.6g} … {high:.6g}")

    # Another way to the same optimum: Gauss–Newton with sensitivity functions, as in [F].
    other = fit(model, record, method="gauss-newton")
    print(f"\nGauss–Newton: {other.message}, residual rms {other.residual_rms:.6g}")

    if picture is not None:
        plot(found).figure.savefig(picture)
    values = dict(zip(found.parameters, map(float, found.values), strict=True))
    return {
        **values,
        "residual_rms": found.residual_rms,
        "largest_difference_of_methods_in_std": float(abs((other.values - found.values) / found.std).max()),
    }


if __name__ == "__main__":
    main(*sys.argv[1:2])
