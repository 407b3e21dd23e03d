"""Forces at nodes that are not linear, as tables of rotor files and of small models: films, seals, stops."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields
from typing import Any, get_args

from fem import JournalBearing, MuszynskaSeal, NodeForce, Stop
from fem.forces import FORCES, Film, kind_of
from rotorid.base.registry import find
from rotorid.files import units
from rotorid.files.settings_keys import Key, Kind, Quantity, take
from rotorid.files.toml_file import Section
from rotorid.files.units import Unit
from rotorid.files.value_kinds import ABOVE_ZERO, choice, number
from rotorid.tables.rotor.bearing import NAME, NODE
from rotorid.tables.rotor.rotor_plausibility import warn_of_force

_SIZE = number(0.0)
_EXPONENT = number(0.0, 10.0)


def _needed(name: str, kind: Kind, about: str, of: dict[str, Unit] | None = None) -> Key:
    return Key(name, kind, about, of, required=f"the {about}")


_PLACE = (
    Key("node", NODE, "the node, a number from 1, or a station"),
    Key("name", NAME, "a name", default=""),
)
_FILM = (
    _needed("length_mm", ABOVE_ZERO, "length along the shaft", units.LENGTH),
    _needed("diameter_mm", ABOVE_ZERO, "diameter of the journal", units.LENGTH),
    _needed("clearance_um", ABOVE_ZERO, "radial clearance", units.LENGTH),
    _needed("viscosity_mPa_s", ABOVE_ZERO, "viscosity of the fluid in the film", units.VISCOSITY),
)
KEYS_OF_FORCE: dict[str, tuple[Key, ...]] = {
    "journal_bearing": (
        *_PLACE,
        *_FILM,
        Key(
            "film",
            choice(get_args(Film)),
            "where the film carries: where its pressure is positive (the default), or on the half circle "
            "that the line of centres bounds",
            default=JournalBearing.film,
        ),
    ),
    "squeeze_film": (
        *_PLACE,
        *_FILM,
        Key("centring_stiffness_N_per_m", _SIZE, "of the spring that centres it", units.STIFFNESS, 0.0),
    ),
    "annular_seal": (
        *_PLACE,
        _needed("stiffness_N_per_m", _SIZE, "stiffness K₀ at the centre", units.STIFFNESS),
        _needed("damping_N_s_per_m", _SIZE, "damping D₀ at the centre", units.DAMPING),
        Key("fluid_mass_kg", _SIZE, "inertia of the fluid that turns in it", units.MASS, 0.0),
        _needed("swirl_ratio", _SIZE, "mean speed τ₀ of the fluid by the shaft's, about 0.5 or less"),
        _needed("clearance_um", ABOVE_ZERO, "radial clearance", units.LENGTH),
        Key("stiffness_exponent", _EXPONENT, "n, default 2", default=MuszynskaSeal.stiffness_exponent),
        Key("swirl_exponent", _EXPONENT, "b, default 0.5", default=MuszynskaSeal.swirl_exponent),
    ),
    "cubic_spring": (
        *_PLACE,
        Key("stiffness_N_per_m", _SIZE, "of small displacements", units.STIFFNESS, 0.0),
        _needed(
            "cubic_stiffness_N_per_m3", _SIZE, "force by the cube of the displacement", units.CUBIC_STIFFNESS
        ),
    ),
    "stop": (
        *_PLACE,
        _needed("gap_um", _SIZE, "radial gap between shaft and ring", units.LENGTH),
        _needed("stiffness_N_per_m", ABOVE_ZERO, "stiffness of the contact", units.STIFFNESS),
        Key("damping_N_s_per_m", _SIZE, "damping of the contact", units.DAMPING, 0.0),
        Key("friction", _SIZE, "coefficient of dry friction; default: none", default=0.0),
        Key("diameter_mm", ABOVE_ZERO, "of the shaft where it rubs; friction needs it", units.LENGTH, 0.0),
        Key(
            "slip_speed_m_s",
            ABOVE_ZERO,
            "below it friction grows with the slip, default 0.01 m/s",
            units.VELOCITY,
            Stop.slip_speed,
        ),
    ),
    "internal_damping": (
        *_PLACE,
        _needed("damping_N_s_per_m", _SIZE, "damping that turns with the shaft", units.DAMPING),
    ),
}
"""By the names of `FORCES`; each in the order of the fields of its class."""


def read_force(section: Section, node: Callable[[Section], int | None], kind: str) -> NodeForce | None:
    """Read one table of a kind of `FORCES`, such as `[[journal_bearing]]`, or None and problems.

    `node` reads its node. A `TableWarning` is given of values that are no machine's.
    """
    said = take(section, KEYS_OF_FORCE[kind])
    where = node(section)
    made = find(FORCES, kind, "kind").function
    values = {
        item.name: value.si if isinstance(value, Quantity) else value
        for item, value in zip(fields(made), said.values(), strict=True)
    }
    if values.get("friction") and not values["diameter"] and "diameter_mm" not in section.refused:
        section.missing("diameter_mm", "the shaft's diameter where it rubs: friction acts against the slip")
    if where is None or section.refused:
        return None
    try:
        force: NodeForce = made(**values | {"node": where})
    except ValueError as error:
        section.refuse(f"a possible {kind.replace('_', ' ')}: {error}")
        return None
    warn_of_force(section.source, force)
    return force


def force_tables(forces: Iterable[NodeForce]) -> dict[str, list[dict[str, Any]]]:
    """Forces as tables that `read_force` reads, by kind, in SI; what is the default is left out."""
    out: dict[str, list[dict[str, Any]]] = {}
    for force in forces:
        keys = KEYS_OF_FORCE[kind_of(force)]
        values = [getattr(force, item.name) for item in fields(force)]
        out.setdefault(kind_of(force), []).append(
            {
                _name_in_si(key): value
                for key, value in zip(keys, values, strict=True)
                if key.required or value != key.default
            }
        )
    return out


def _name_in_si(key: Key) -> str:
    return next(name for name, unit in key.variants.items() if unit is None or unit.scale == 1.0)
