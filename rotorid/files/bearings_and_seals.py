"""What stands at nodes in rotor files and small models: bearings, seals (constant or over speed), forces."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import PlainValidator, create_model

from fem import KINDS, NodeForce, Pedestal, Support
from fem.forces import FORCES, Film, kind_of
from rotorid.base.arrays import FloatArray
from rotorid.base.choices import did_you_mean, find
from rotorid.base.tables import csv_bytes
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import OUTWARDS, Column, Table, read_table
from rotorid.files.input_problems import InputError, Problems
from rotorid.files.settings import NotNegative, Number, Positive, Settings, Text, key, listed, optional
from rotorid.files.units import one_of

T = TypeVar("T")
S = TypeVar("S", bound=Settings)
_NODE = "a node: its number from 1, or the name of a station"
ENTRIES = {"stiffness": ("kxx", "kxy", "kyx", "kyy"), "damping": ("cxx", "cxy", "cyx", "cyy")}
"""Entries of the matrix of a quantity."""
_DIAGONAL = (*ENTRIES, "kxx", "kyy", "cxx", "cyy")
_COEFFICIENTS = dict.fromkeys(("stiffness", *ENTRIES["stiffness"]), ("N_per_m", units.STIFFNESS))
_COEFFICIENTS |= dict.fromkeys(("damping", *ENTRIES["damping"]), ("N_s_per_m", units.DAMPING))
NAMES = {name: f"{name}_{usual}" for name, (usual, _) in _COEFFICIENTS.items()}
COLUMNS = (
    Column("speed", one_of(units.SPEED), ("speed_rpm", "speed_rad_s", "speed_Hz")),
    *(Column(name, one_of(of), (NAMES[name],), required=False) for name, (_, of) in _COEFFICIENTS.items()),
)


def _node(value: object) -> object:
    if isinstance(value, str) or (type(value) is int and value > 0):
        return value
    raise ValueError(_NODE)


def _two(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(values) > 2:
        raise ValueError("a number, or two: [x, y]")
    return values if len(values) == 2 else 2 * values


Node = Annotated[int | str, PlainValidator(_node, json_schema_input_type=int | str)]
OneOrTwo = listed(NotNegative, _two)


class Place(Settings):
    """What stands at a node."""

    node: Node = key("the node, a number from 1, or a station", expected=_NODE)
    name: str = key("a name", default="")


class _SupportKeys(Place):
    tilting_stiffness: NotNegative = key(
        "moment against a tilt of the shaft", "tilting_stiffness_N_m_per_rad", 0.0
    )
    kind: Literal["bearing", "seal"] = key("which it is, where it is another one", default="bearing")
    pedestal_mass: NotNegative = key("mass of what it stands on", "pedestal_mass_kg", 0.0, units=units.MASS)
    pedestal_stiffness: OneOrTwo = optional(  # type: ignore[valid-type]
        "its stiffness; one number, or two for x and y",
        "pedestal_stiffness_N_per_m",
        units=units.STIFFNESS,
    )
    pedestal_damping: OneOrTwo = key(  # type: ignore[valid-type]
        "its damping; one number, or two for x and y",
        "pedestal_damping_N_s_per_m",
        (0.0, 0.0),
        units=units.DAMPING,
    )
    table: Text | None = optional("a table of these coefficients over speed")

    @property
    def constants(self) -> dict[str, Any]:
        """The coefficients that are written here."""
        return {name: value for name in NAMES if (value := getattr(self, name)) is not None}

    def wrong(self) -> Iterator[tuple[str, str]]:
        """A bearing that pushes outwards, and a pedestal of no stiffness."""
        for name, value in self.constants.items():
            if self.kind == "bearing" and name in _DIAGONAL and value < 0:
                yield name, OUTWARDS
        if not self.has("pedestal_stiffness") and (self.pedestal_mass or any(self.pedestal_damping)):
            yield "pedestal_stiffness", "the stiffness of the pedestal"

    def made(self, node: int, folder: Path) -> Support:
        """The support at a node, its table named from a folder."""
        values, speeds, stand = self.constants, np.empty(0), None
        if self.table is not None:
            table = _over_speed(folder / self.table, self.kind)
            columns = {name: table.numbers(name) for name in table.fields}
            speeds = columns.pop("speed")
            if twice := values.keys() & columns:
                raise ValueError(f"{NAMES[min(twice)]} once: {table.grid.source} has this column, too")
            values |= columns
        if not values:
            raise ValueError("its stiffness is missing, or its damping, here and in a table over speed")
        if self.has("pedestal_stiffness"):
            stand = Pedestal(**{name: getattr(self, f"pedestal_{name}") for name in ("mass", *ENTRIES)})
        stiffness, damping = (_matrices(quantity, values) for quantity in ENTRIES)
        more = stand, self.kind, self.tilting_stiffness
        return Support(node, stiffness, damping, self.name, tuple(speeds), *more)


def _coefficient(name: str) -> Any:  # noqa: ANN401
    about, names = f"{name}, the same in all directions", NAMES[name]
    if name not in ENTRIES:
        motion = "displacement" if name[0] == "k" else "velocity"
        about = f"force in {name[1]} against a {motion} in {name[2]}; also `{name}` alone, in SI"
        names += f" {name}"
    return Number | None, optional(about, names, units=_COEFFICIENTS[name][1])


SupportKeys = create_model(
    "SupportKeys", __base__=_SupportKeys, **{name: _coefficient(name) for name in NAMES}
)


class SealKeys(SupportKeys):  # type: ignore[misc, valid-type]
    """Keys of a `[[seal]]`."""

    kind: Literal["seal"] = key("which it is", default="seal")


class _ForceKeys(Place):
    def wrong(self) -> Iterator[tuple[str, str]]:
        """Friction without a diameter."""
        if getattr(self, "friction", 0.0) and not self.model_dump()["diameter"]:
            yield "diameter", "the shaft's diameter where it rubs: friction acts against the slip"

    def made(self, node: int, folder: Path) -> NodeForce:
        """The force at a node."""
        values: dict[str, Any] = self.model_dump() | {"node": node}
        force: NodeForce = find(FORCES, type(self).__name__, "kind").function(**values)
        return force


_FORCE_KEYS: dict[str, tuple[str, Mapping[str, units.Unit] | None, str]] = {
    "length": ("length_mm", units.LENGTH, "length along the shaft"),
    "diameter": ("diameter_mm", units.LENGTH, "diameter of the shaft there; of a stop friction needs it"),
    "clearance": ("clearance_um", units.LENGTH, "radial clearance"),
    "viscosity": ("viscosity_mPa_s", units.VISCOSITY, "viscosity of the fluid in the film"),
    "film": (
        "film",
        None,
        "where the film carries: where its pressure is positive (the default), or on the half circle that "
        "the line of centres bounds",
    ),
    "centring_stiffness": (
        "centring_stiffness_N_per_m",
        units.STIFFNESS,
        "of the spring that centres it; default: none",
    ),
    "stiffness": ("stiffness_N_per_m", units.STIFFNESS, "stiffness at the centre, or of the contact"),
    "damping": (
        "damping_N_s_per_m",
        units.DAMPING,
        "damping, likewise; internal damping turns with the shaft",
    ),
    "fluid_mass": ("fluid_mass_kg", units.MASS, "inertia of the fluid that turns in it; default: none"),
    "swirl_ratio": ("swirl_ratio", None, "mean speed τ₀ of the fluid by the shaft's, about 0.5 or less"),
    "stiffness_exponent": ("stiffness_exponent", None, "n, default 2"),
    "swirl_exponent": ("swirl_exponent", None, "b, default 0.5"),
    "cubic_stiffness": (
        "cubic_stiffness_N_per_m3",
        units.CUBIC_STIFFNESS,
        "force by the cube of the displacement",
    ),
    "gap": ("gap_um", units.LENGTH, "radial gap between shaft and ring"),
    "friction": ("friction", None, "coefficient of dry friction; default: none"),
    "slip_speed": (
        "slip_speed_m_s",
        units.VELOCITY,
        "below it friction grows with the slip, default 0.01 m/s",
    ),
}
"""Of fields of forces: name of the key, its units, what it is."""
_MAY_LACK = {"centring_stiffness", "fluid_mass", "friction", "cubic_spring stiffness", "stop damping"}
_MAY_LACK |= {"stop diameter"}


def _force_keys(kind: str, force: type[NodeForce]) -> type[Place]:
    """The keys of a kind, from the fields of its class."""
    keys: dict[str, Any] = {}
    for item in fields(force)[2:]:
        name, of, about = _FORCE_KEYS[item.name]
        needed = not item.default and _MAY_LACK.isdisjoint((item.name, f"{kind} {item.name}"))
        number: Any = Positive if item.name in force.above_zero else NotNegative
        default = ... if needed else item.default
        keys[item.name] = Film if item.name == "film" else number, key(about, name, default, units=of)
    return create_model(kind, __base__=_ForceKeys, **keys)


KEYS: dict[str, Any] = {"bearing": SupportKeys, "seal": SealKeys}
KEYS |= {method.name: _force_keys(method.name, method.function) for method in FORCES}
"""Settings of each kind of support and force."""
_TABLES: dict[str, Any] = {
    kind.name: (GenericAlias(list, (KEYS[kind.name],)), key(kind.about, default=[]))
    for kind in (*KINDS, *FORCES)
}
Attached = create_model("Attached", __base__=Settings, **_TABLES)
"""Settings of a file with tables of bearings, seals and forces."""


def places(nodes: Collection[int], stations: Mapping[str, int]) -> Callable[[Place], int]:
    """What gives the node of a table of settings, by its number or a station; InputError where it is none."""

    def at(item: Place) -> int:
        name = str(item.node).strip()
        node = stations.get(name, int(name) if name.isdecimal() else 0)
        if node not in nodes:
            known = f"from 1 to {max(nodes)}" if isinstance(nodes, range) else listing(map(str, nodes))
            hint = did_you_mean(name, stations)
            raise InputError([item.problem("node", f"a node {known} or a station{hint}")])
        return node

    return at


def each(problems: Problems, items: Iterable[S], what: str, read: Callable[[S], T]) -> list[T]:
    """What settings say; what is wrong with each, and what a constructor refuses, goes to the problems."""
    out = []
    for item in items:
        try:
            out.append(read(item))
        except InputError as error:
            problems.extend(error.problems)
        except ValueError as error:
            item.complain(problems, "", f"a possible {what}: {error}")
    return out


def whole(item: S, what: str, read: Callable[[S], T]) -> T:
    """What settings say; InputError with what is wrong."""
    problems = Problems()
    values = each(problems, [item], what, read)
    problems.stop()
    return values[0]


def read_attached(
    file: Settings, at: Callable[[Place], int], folder: Path, problems: Problems
) -> dict[str, list[Any]]:
    """`supports` and `forces` of a file, of which tables are named from its folder."""
    made: dict[str, list[Any]] = {"supports": [], "forces": []}
    for kind in KEYS:
        items = each(problems, getattr(file, kind), kind, lambda item: item.made(at(item), folder))
        made["supports" if kind in ("bearing", "seal") else "forces"] += items
    return made


def _matrices(quantity: str, values: Mapping[str, Any]) -> FloatArray:
    """Stiffness or damping: a number, or over speed (n,), or a matrix (2, 2) behind."""
    entries = ENTRIES[quantity]
    used = values.keys() & {*entries}
    if used and (quantity in values or len(used & {entries[0], entries[3]}) == 1):
        both = listing([NAMES[entries[0]], NAMES[entries[3]]], "and")
        raise ValueError(f"either {NAMES[quantity]}, or both {both}")
    if not used:
        return np.asarray(values.get(quantity, 0.0))[()]
    columns = np.broadcast_arrays(*(values.get(name, 0.0) for name in entries))
    return np.stack(columns, axis=-1).reshape(*columns[0].shape, 2, 2)


def _over_speed(path: Path, kind: str) -> Table:
    """A table of coefficients."""
    problems = Problems()
    table = read_table(path, kind, COLUMNS, problems)
    falling = np.diff(table.numbers("speed"), prepend=-1e-300) <= 0
    table.complain_where(falling, "speed", "a speed of 0 or more, above that of the row before (each once)")
    for name in _DIAGONAL if kind == "bearing" else ():
        table.complain_where(table.numbers(name) < 0, name, OUTWARDS)
    if len(table) == 1:
        table.complain(0, "speed", "two speeds at least: a table says how coefficients change")
    problems.stop()
    return table


Written = dict[str, list[dict[str, Any]]]
"""Tables of a file by the name of their kind."""


def force_tables(forces: Iterable[NodeForce]) -> Written:
    """Forces as tables of a file, in SI; what is the default is left out."""
    tables: Written = {}
    for force in forces:
        tables.setdefault(kind_of(force), []).append(in_si(KEYS[kind_of(force)], vars(force)))
    return tables


def support_tables(supports: Sequence[Support], path: Path) -> tuple[Written, dict[Path, bytes]]:
    """Supports in order as tables `[[bearing]]`, in SI, and those over speed as files beside the file."""
    tables: Written = {}
    files = {}
    for number, support in enumerate(supports, start=1):
        values, columns = vars(support) | dict.fromkeys((*ENTRIES, "table")), _columns(support)
        if support.speeds:
            table = path.with_name(f"{path.stem}_{support.kind}_{number}.csv")
            names = ["speed_rad_s", *(NAMES[name] for name in columns)]
            rows = [*zip(support.speeds, *columns.values(), strict=True)]
            values["table"], files[table] = table.name, csv_bytes(names, rows)
        else:
            values |= {name: column[0] for name, column in columns.items()}
        if stand := support.pedestal:
            values |= {f"pedestal_{name}": stand.xy(name) for name in ENTRIES} | {"pedestal_mass": stand.mass}
        tables.setdefault("bearing", []).append(in_si(SupportKeys, values))
    return tables, files


def _columns(support: Support) -> dict[str, list[float]]:
    """Its coefficients at its speeds, or one each; those of matrices where any direction differs."""
    out: dict[str, list[float]] = {}
    for (quantity, entries), matrices in zip(ENTRIES.items(), support.table, strict=True):
        xx, xy, yx, yy = matrices.reshape(-1, 4).T.tolist()
        alike = xx == yy and not any((*xy, *yx))
        out |= {quantity: xx} if alike else dict(zip(entries, (xx, xy, yx, yy), strict=True))
    return out


def in_si(keys: type[Settings], values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by field as a table of a file, by its keys in SI, without those that are the default."""
    return {
        next(name for name, unit in key.variants.items() if unit.scale == 1.0): values[field]
        for (field, one), key in zip(keys.model_fields.items(), keys.known_keys().values(), strict=True)
        if values.get(field, one.default) != one.default
    }
