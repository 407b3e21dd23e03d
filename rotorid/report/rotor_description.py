"""The rotor on a sheet: a drawing of it, and tables of its sections, discs and supports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fem import Rotor
from rotorid.base.rpm import RPM, phase_deg
from rotorid.base.tables import Column, Table
from rotorid.report.document import Cells
from rotorid.report.number_tables import Grid, figures, numbered, words
from rotorid.report.rotor_figures import Drawing, rotor_picture

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fem import SensorLike, Support
    from rotorid.reduction import SmallModel


@dataclass(frozen=True)
class RotorSheet:
    """What a sheet says about its rotor.

    Attributes
    ----------
    facts
        Short ones: name and words.
    drawing
        To scale.
    tables
        Sections, discs and masses, supports, tabulated coefficients.
    """

    facts: tuple[tuple[str, str], ...]
    drawing: Drawing
    tables: tuple[Grid, ...]


def rotor_sheet(
    rotor: Rotor,
    *,
    planes: Sequence[str | int] = (),
    sensors: Sequence[SensorLike] = (),
    meaning: str = "",
    conservative: bool = False,
    at_rest: bool = False,
) -> RotorSheet:
    """Describe a rotor.

    Parameters
    ----------
    rotor
        The rotor.
    planes, sensors
        Nodes or stations to mark in the drawing.
    meaning
        What stands at the planes.
    conservative
        Whether the results are those without damping and without coupling that does work.
    at_rest
        Whether they are those of the plane x of the rotor that does not turn.

    Raises
    ------
    ValueError
        If a plane or sensor is no node of the rotor.
    """
    tables = [_sections(rotor), _discs(rotor), _supports(rotor), *_coefficients(rotor)]
    return RotorSheet(
        _facts(rotor, conservative=conservative or at_rest, at_rest=at_rest),
        rotor_picture(rotor, planes, sensors, meaning),
        tuple(table for table in tables if table.rows),
    )


def place(rotor: Rotor, node: int) -> str:
    """Print a node with the names of its stations."""
    names = [name for name, where in rotor.stations.items() if where == node]
    return f"{node} ({', '.join(names)})" if names else str(node)


def unbalance_table(rotor: Rotor | SmallModel, unbalance: Mapping[int, complex]) -> Table:
    """What is mounted: kg·m printed in g·mm, angles in degrees with the rotation."""
    mounted, along = sorted(unbalance.items()), list[Column]()
    names = [str(node) for node, _ in mounted]
    if isinstance(rotor, Rotor):
        names = [place(rotor, node) for node, _ in mounted]
        positions = [rotor.positions[node - 1] for node, _ in mounted]
        along = [Column("position, m", positions, "{:.6g}".format)]
    columns = (
        Column("node", names),
        *along,
        Column("unbalance, g·mm", [1e6 * abs(u) for _, u in mounted], "{:.6g}".format),
        Column("angle, ° with the rotation", [float(phase_deg(u)) for _, u in mounted], "{:.6g}".format),
    )
    return Table("what is mounted", columns)


def _facts(rotor: Rotor, *, conservative: bool, at_rest: bool) -> tuple[tuple[str, str], ...]:
    model = rotor.model
    counted = {
        "shear": model.shear,
        "rotary inertia": model.rotary_inertia,
        "gyroscopic moments": model.gyroscopic,
    }
    if at_rest:
        counted["gyroscopic moments"] = False
    used = [word for word, on in counted.items() if on]
    left = [word for word, on in counted.items() if not on]
    if conservative and (any(s.damped for s in rotor.supports) or rotor.material_damping.any()):
        left.append("damping")
    if conservative and any(s.coupled for s in rotor.supports):
        left.append("coupling of x and y" if at_rest else "cross-coupling that does work (kxy − kyx)")
    if at_rest and any(s.pedestal is not None and s.pedestal.mass > 0 for s in rotor.supports):
        left.append("masses of the pedestals (the small model has them)")
    stations = ", ".join(f"{name} at node {node}" for name, node in rotor.stations.items())
    facts = [
        ("Rotor", f"{rotor.n_elements} elements, {rotor.positions[-1]:.6g} m, {rotor.total_mass:.6g} kg"),
        ("Counted", ", ".join(["bending and mass", *used])),
        ("Left out by formula (50)" if at_rest else "Left out", ", ".join(left) or "nothing"),
        ("Stations", stations),
        *((name, text) for name, _, text in _material(rotor) if text),
    ]
    return tuple((name, text) for name, text in facts if text)


def _material(rotor: Rotor) -> list[tuple[str, np.ndarray, str]]:
    """What elements are made of: name with unit, values, and the one value if all have it."""
    named = {
        "Young's modulus, GPa": rotor.youngs_modulus / 1e9,
        "Density, kg/m³": rotor.density,
        "Poisson's ratio": rotor.poisson_ratio if rotor.model.shear else np.zeros(1),
        "Material damping, s": rotor.material_damping,
    }
    kept = {name: values for name, values in named.items() if values.any()}
    return [(n, v, f"{v[0]:.6g}" if (v == v[0]).all() else "") for n, v in kept.items()]


def _sections(rotor: Rotor) -> Grid:
    """One row per element."""
    columns = {
        "from, m": rotor.positions[:-1],
        "length, mm": 1e3 * rotor.length,
        "outer diameter, mm": 1e3 * rotor.outer_diameter,
    }
    if rotor.inner_diameter.any():
        columns["bore, mm"] = 1e3 * rotor.inner_diameter
    columns |= {name: values for name, values, one in _material(rotor) if not one}
    printed = (figures(head, values.tolist()) for head, values in columns.items())
    return Grid("Shaft, one row per element", (numbered("element", rotor.n_elements), *printed))


def _discs(rotor: Rotor) -> Grid:
    """Discs and concentrated masses; inertias and names only where there are any."""
    discs = sorted(rotor.discs, key=lambda disc: disc.node)
    columns = [figures("node", (disc.node for disc in discs))]
    if any(disc.name for disc in discs):
        columns.append(words("name", (disc.name for disc in discs)))
    columns.append(figures("mass, kg", (disc.mass for disc in discs)))
    if any(disc.polar_inertia or disc.diametral_inertia for disc in discs):
        columns.append(figures("polar inertia, kg·m²", (disc.polar_inertia for disc in discs)))
        columns.append(figures("diametral inertia, kg·m²", (disc.diametral_inertia for disc in discs)))
    return Grid("Discs and masses", tuple(columns))


def _supports(rotor: Rotor) -> Grid:
    supports = rotor.supports
    return Grid(
        "Supports",
        (
            words("node", (place(rotor, support.node) for support in supports)),
            words("support", (f"{support.kind} {support.name}".strip() for support in supports)),
            words("stiffness, N/m", (_words(support, 0) for support in supports)),
            words("damping, N·s/m", (_words(support, 1) for support in supports)),
            words("besides", (_beside(support) for support in supports)),
        ),
    )


def _words(support: Support, which: int) -> str:
    """Stiffness (0) or damping (1) of a support in words."""
    if support.speeds:
        return "tabulated over speed, see below"
    (xx, xy), (yx, yy) = support.at(0.0)[which].tolist()
    if xx == yy and xy == yx == 0:
        return f"{xx:.6g}"
    named = {"xx": xx, "xy": xy, "yx": yx, "yy": yy}
    return ", ".join(f"{name} {value:.6g}" for name, value in named.items() if value)


def _beside(support: Support) -> str:
    """Pedestal and tilting stiffness in words."""
    said = []
    if support.pedestal is not None:
        k, c = (
            " and ".join(f"{value:.6g}" for value in dict.fromkeys(support.pedestal.xy(name)))
            for name in ("stiffness", "damping")
        )
        said.append(f"pedestal {support.pedestal.mass:.6g} kg, {k} N/m (x and y), {c} N·s/m")
    if support.tilting_stiffness:
        said.append(f"tilting {support.tilting_stiffness:.6g} N·m/rad")
    return "; ".join(said) or "–"


def _coefficients(rotor: Rotor) -> list[Grid]:
    """Tables of tabulated coefficients; supports that share them share the tables."""
    tables: dict[tuple[str, tuple[Cells, ...]], list[str]] = {}
    kinds = (("Stiffness, MN/m", "k", 1e6), ("Damping, kN·s/m", "c", 1e3))
    for number, support in enumerate(rotor.supports, start=1):
        if not support.speeds:
            continue
        for (caption, letter, unit), matrices in zip(kinds, support.at(support.speeds), strict=True):
            columns = [figures("rpm", (omega * RPM for omega in support.speeds))]
            for name, entries in zip(("xx", "xy", "yx", "yy"), matrices.reshape(-1, 4).T, strict=True):
                columns.append(figures(letter + name, (entries / unit).tolist()))
            named = tables.setdefault((caption, tuple(columns)), [])
            named.append(f"{support.kind} {support.name or number}")
    return [Grid(f"{caption}: {', '.join(named)}", columns) for (caption, columns), named in tables.items()]
