"""Plausibility of a rotor: warnings about values unlike any that was built, with the unit probably meant."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from dataclasses import dataclass

import numpy as np

from fem import NodeForce, Rotor
from fem.forces import ShortFilm
from rotorid.base.arrays import BoolArray
from rotorid.base.checks import attachment
from rotorid.base.text import counted
from rotorid.files.columns import Table
from rotorid.files.problems import TableWarning

_GRAVITY = 9.81
_SAG = 10.0  # m: of a rotor on its bearings, which then swings below 0.2 Hz


@dataclass(frozen=True)
class Usual:
    """What a quantity is in machines.

    Attributes
    ----------
    low, high
        Outside nothing was built.
    unit
        That of the value.
    likely
        Range of what is common.
    others
        Other units by their size in `unit`.
    """

    low: float
    high: float
    unit: str
    likely: tuple[float, float]
    others: tuple[tuple[str, float], ...]

    def question(self, value: float) -> str:
        """In which unit a value was probably written; empty if it may be right."""
        if value == 0 or self.low <= value <= self.high:
            return ""
        meant = [name for name, size in self.others if self.likely[0] <= value * size <= self.likely[1]]
        return f"is this in {meant[0] if meant else 'another unit'}?"


_LENGTHS = (("mm", 1e-3), ("m", 1e3), ("in", 0.0254))
USUAL = {
    "length": Usual(5e-5, 50.0, "m", (1e-3, 20.0), _LENGTHS),
    "diameter": Usual(5e-4, 10.0, "m", (2e-3, 5.0), _LENGTHS),
    "inner_diameter": Usual(0.0, 10.0, "m", (1e-3, 5.0), _LENGTHS),
    "youngs_modulus": Usual(
        1e9, 1e12, "Pa", (1e10, 5e11), (("MPa", 1e6), ("GPa", 1e9), ("psi", 6894.757), ("kPa", 1e3))
    ),
    "density": Usual(100.0, 3e4, "kg/m³", (900.0, 2.3e4), (("g/cm³", 1e3), ("kg/mm³", 1e9), ("t/mm³", 1e12))),
    "clearance": Usual(2e-6, 5e-3, "m", (1e-5, 1e-3), ()),
    "gap": Usual(1e-7, 2e-2, "m", (1e-5, 2e-3), ()),
    "viscosity": Usual(1e-5, 2.0, "Pa·s", (2e-4, 0.5), ()),
    "swirl_ratio": Usual(0.0, 1.0, "of the shaft's speed", (0.05, 0.9), (("percent", 0.01),)),
    "friction": Usual(0.0, 1.5, "of the normal force", (0.01, 0.9), (("percent", 0.01),)),
}
_CLEARANCE_BY_RADIUS = (2e-4, 1e-2)
_SHORT = 0.5  # length by diameter up to which the film of `fem.forces` is used
_STIFF = (("N/mm", 1e3), ("N/µm", 1e6))  # by their size in N/m


def warn_of_table(table: Table, elements: BoolArray) -> None:
    """Sizes of a rotor table in a wrong unit give a rotor that can be computed all the same."""
    for stem, usual in USUAL.items():
        if stem not in table:
            continue
        field, values = table.fields[stem], table.numbers(stem)
        outside = elements & (values > 0) & ((values < usual.low) | (values > usual.high))
        rows = np.flatnonzero(outside)
        for row in rows[:1].tolist():
            others = rows.size - 1
            more = f" and {counted(others, 'more row')}" if others else ""
            _warn(
                f"{table.source}, row {table.rows[row]}{more}, column {field.name}: "
                f"{table.shown(stem, row)} means {values[row]:.6g} {usual.unit}; "
                f"{usual.question(float(values[row]))}"
            )
    if "element" in table:
        _warn_of_labels(table, np.flatnonzero(elements).tolist())


def warn_of_value(source: str, key: str, stem: str, value: float) -> None:
    """One value of a rotor file."""
    question = USUAL[stem].question(value)
    if question:
        _warn(f"{source}, {key}: {value:.6g} {USUAL[stem].unit}; {question}")


def warn_of_force(source: str, force: NodeForce) -> None:
    """A force at a node whose values are unlike those of any machine."""
    what = f"{source}, {attachment(force)}"
    for stem, usual in USUAL.items():
        value = getattr(force, stem, 0.0)
        if question := usual.question(value):
            _warn(f"{what}: {stem} {value:.6g} {usual.unit}; {question}")
            return
    if not isinstance(force, ShortFilm):
        return
    ratio, slender = 2 * force.clearance / force.diameter, force.length / force.diameter
    low, high = _CLEARANCE_BY_RADIUS
    if not low <= ratio <= high:
        _warn(
            f"{what}: the radial clearance is {ratio:.3g} of the journal's radius, in machines {low:g} "
            f"to {high:g}; is one of them in another unit, or a diameter taken for a radius?"
        )
    elif round(slender, 6) > _SHORT:
        _warn(
            f"{what}: its length is {slender:.3g} of its diameter; short films have up to {_SHORT:g}, a "
            "longer one carries less than is computed, about half as much at 1"
        )


def warn_of_rotor(source: str, rotor: Rotor) -> None:
    """What only the whole rotor shows: its shape, and how its bearings carry it."""
    span, thin = float(rotor.positions[-1]), float(rotor.outer_diameter.min())
    # a shaft without mass is a model, not a body; a diameter beyond any was asked about already
    if span < thin <= USUAL["diameter"].high and rotor.density.any():
        _warn(
            f"{source}: the shaft is {span:.4g} m long in all and {thin:.4g} m thick at least; are length "
            "and diameter exchanged?"
        )
    if max(span, float(rotor.outer_diameter.max())) > USUAL["length"].high:
        return  # nor is the mass then known
    bearings = [s for s in rotor.supports if s.kind == "bearing"]
    soft, first = [], ""
    for number, bearing in enumerate(bearings, start=1):
        k = bearing.at(np.array(bearing.speeds or (0.0,)))[0]
        stiff = float(np.linalg.norm(k, axis=(1, 2)).max()) / math.sqrt(2)
        weight = _GRAVITY * rotor.total_mass / len(bearings)
        if 0 < stiff < weight / _SAG:
            meant = [name for name, size in _STIFF if weight / (stiff * size) < 0.01]
            name = repr(bearing.name) if bearing.name else f"{number} at node {bearing.node}"
            soft.append(
                f"of {stiff:.4g} N/m would sag {weight / stiff:.3g} m under its share of "
                f"{rotor.total_mass:.4g} kg; is its stiffness in {meant[0] if meant else 'another unit'}?"
            )
            first = first if len(soft) > 1 else name
    if soft:
        more = f" (and {len(soft) - 1} more)" if len(soft) > 1 else ""
        _warn(f"{source}: bearing {first}{more} {soft[0]}")


def _warn_of_labels(table: Table, rows: list[int]) -> None:
    """A number of an element that stands twice; names may be kinds of elements."""
    labels = Counter(label for row in rows if (label := table.shown("element", row).strip()))
    twice = [label for label, n in labels.items() if n > 1 and label.isdecimal()]
    if twice:
        second = [table.rows[row] for row in rows if table.shown("element", row).strip() == twice[0]][1]
        _warn(f"{table.source}, row {second}: there is an element {twice[0]} before; is a row twice here?")


def _warn(text: str) -> None:
    warnings.warn(text, TableWarning, stacklevel=4)
