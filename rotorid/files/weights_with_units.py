"""Weights that a job writes with their units, as its weights are: masses, or unbalances (mass × radius)."""

from __future__ import annotations

from rotorid.files import units
from rotorid.files.units import Quantity


def in_job_units(weight: Quantity, unit: str, radius: float | None) -> tuple[float, ...] | None:
    """A mass or unbalance, or several, in kg or kg·m.

    Parameters
    ----------
    weight
        With its unit.
    unit
        That of the job's weights: which of the two is wanted.
    radius
        m, converts between them.

    Returns
    -------
    None where a radius is needed and there is none.
    """
    values = weight.value if isinstance(weight.value, tuple) else (weight.value,)
    sizes = tuple(weight.unit.to_si(value) for value in values)
    wanted = units.weight(unit).kind
    if weight.unit.kind == wanted:
        return sizes
    if radius is None:
        return None
    return tuple(size * radius if wanted == "unbalance" else size / radius for size in sizes)
