"""Forces at nodes in rotor files and small models: `[[journal_bearing]]` and other kinds of `fem.forces`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from pydantic import PlainValidator, create_model

from fem import NodeForce, Rotor
from fem.forces import FORCES, Film, kind_of
from rotorid.base.choices import did_you_mean, find
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.problems import InputError, Problems
from rotorid.files.settings import NotNegative, Positive, Settings, key

if TYPE_CHECKING:
    from rotorid.files.columns import Table
    from rotorid.reduction import SmallModel

T = TypeVar("T")
S = TypeVar("S", bound=Settings)
_NODE = "a node: its number from 1, or the name of a station"


def _node(value: object) -> object:
    if isinstance(value, str) or (type(value) is int and value > 0):
        return value
    raise ValueError(_NODE)


Node = Annotated[int | str, PlainValidator(_node, json_schema_input_type=int | str)]


class Place(Settings):
    """What stands at a node."""

    node: Node = key("the node, a number from 1, or a station", expected=_NODE)
    name: str = key("a name", default="")


_FIELDS: dict[str, tuple[str, Mapping[str, units.Unit] | None, str]] = {
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
"""Of the classes of forces: name of the key, its units, what it is."""
_MAY_LACK = {"centring_stiffness", "fluid_mass", "friction", "cubic_spring stiffness", "stop damping"}
_MAY_LACK |= {"stop diameter"}


class _Force(Place):
    def wrong(self) -> Iterator[tuple[str, str]]:
        """Friction without a diameter."""
        if getattr(self, "friction", 0.0) and not self.model_dump()["diameter"]:
            yield "diameter", "the shaft's diameter where it rubs: friction acts against the slip"


def _keys(kind: str, force: type[NodeForce]) -> type[Place]:
    """The keys of a kind, from the fields of its class."""
    keys: dict[str, Any] = {}
    for item in dataclasses.fields(force)[2:]:
        name, of, about = _FIELDS[item.name]
        needed = not item.default and {item.name, f"{kind} {item.name}"}.isdisjoint(_MAY_LACK)
        type_: Any = (
            Film if item.name == "film" else Positive if item.name in force.above_zero else NotNegative
        )
        keys[item.name] = type_, key(about, name, ... if needed else item.default, units=of)
    return create_model(kind, __base__=_Force, **keys)


KEYS = {method.name: _keys(method.name, method.function) for method in FORCES}
"""Settings of each kind of `FORCES`."""


def node_number(value: int | str, nodes: Collection[int], stations: Mapping[str, int]) -> int:
    """The number of a node, given by it or its text, or by the name of a station.

    Raises
    ------
    ValueError
        That says what is expected.
    """
    number = stations.get(str(value), int(value) if str(value).strip().isdecimal() else 0)
    if number in nodes:
        return number
    if isinstance(nodes, range):
        hint = did_you_mean(str(value), stations)
        raise ValueError(f"a node from 1 to {nodes.stop - 1} or a station{hint}")
    raise ValueError(f"one of the nodes {listing(map(str, nodes))}")


def nodes_in(table: Table, stem: str, rotor: Rotor | SmallModel | None) -> list[int | str]:
    """Nodes in cells; without a rotor labels too, "" where there is a problem."""
    nodes: list[int | str] = []
    for row, name in enumerate(table.texts(stem)):
        try:
            if rotor is None:
                nodes.append(int(name) if name.isascii() and name.isdecimal() else name)
            else:
                numbers = getattr(rotor, "nodes", range(1, getattr(rotor, "n_nodes", 0) + 1))
                nodes.append(node_number(name, numbers, getattr(rotor, "stations", {})) if name else "")
        except ValueError as error:
            table.complain(row, stem, str(error))
            nodes.append("")
    return nodes


@dataclasses.dataclass(frozen=True)
class Places:
    """The nodes of a model, by number and by the name of a station."""

    nodes: Collection[int]
    stations: Mapping[str, int]

    def __call__(self, item: Place) -> int:
        """The node of a table of settings; InputError where it is none."""
        try:
            return node_number(item.node, self.nodes, self.stations)
        except ValueError as error:
            raise InputError([item.problem("node", str(error))]) from None


def each(problems: Problems, items: Iterable[S], what: str, read: Callable[[S], T]) -> list[T]:
    """What settings say; what is wrong with each, and what a constructor refuses, goes to the problems."""
    out = []
    for item in items:
        try:
            out.append(read(item))
        except InputError as error:
            problems.extend(error.problems)
        except ValueError as error:
            problems.extend([item.problem("", f"a possible {what}: {error}")])
    return out


def whole(item: S, what: str, read: Callable[[S], T]) -> T:
    """What settings say; InputError with what is wrong."""
    problems = Problems()
    found = each(problems, [item], what, read)
    problems.stop()
    return found[0]


def read_force(item: Place, node: int) -> NodeForce:
    """A force from its settings, at a node."""
    values: dict[str, Any] = {**item.model_dump(), "node": node}
    force: NodeForce = find(FORCES, type(item).__name__, "kind").function(**values)
    return force


def force_tables(forces: Iterable[NodeForce]) -> dict[str, list[dict[str, Any]]]:
    """Forces as tables of a file, by kind, in SI; what is the default is left out."""
    out: dict[str, list[dict[str, Any]]] = {}
    for force in forces:
        kind = kind_of(force)
        out.setdefault(kind, []).append(in_si(KEYS[kind], vars(force)))
    return out


def in_si(keys: type[Settings], values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by field as a table of a file, by its keys in SI, without those that are the default."""
    return {
        next(name for name, unit in key.variants.items() if unit.scale == 1.0): values[field]
        for (field, one), key in zip(keys.model_fields.items(), keys.known_keys().values(), strict=True)
        if values.get(field, one.default) != one.default
    }
