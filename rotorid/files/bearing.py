"""What stands at nodes in rotor files and small models: bearings, seals (constant or over speed), forces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, create_model

from fem import KINDS, NodeForce, Pedestal, Support
from fem.forces import FORCES
from rotorid.base.arrays import FloatArray
from rotorid.base.tables import csv_bytes
from rotorid.base.text import listing
from rotorid.files import forces, units
from rotorid.files.columns import Column, Table, read_table
from rotorid.files.forces import Place, Places, each, in_si, read_force
from rotorid.files.problems import Problems
from rotorid.files.settings import NotNegative, Number, Settings, Text, key
from rotorid.files.units import one_of

OUTWARDS = "a finite number, 0 or more; what pushes outwards, or drives, is a [[seal]], not a [[bearing]]"
ENTRIES = {
    "stiffness": ("kxx", "kxy", "kyx", "kyy"),
    "damping": ("cxx", "cxy", "cyx", "cyy"),
}
_DIAGONAL = ("stiffness", "damping", "kxx", "kyy", "cxx", "cyy")
_STIFFNESS = dict.fromkeys(("stiffness", *ENTRIES["stiffness"]), ("N_per_m", units.STIFFNESS))
COEFFICIENTS = _STIFFNESS | dict.fromkeys(("damping", *ENTRIES["damping"]), ("N_s_per_m", units.DAMPING))
"""Their units: the usual one, and all."""
NAMES = {name: f"{name}_{usual}" for name, (usual, _) in COEFFICIENTS.items()}
COLUMNS = (
    Column("speed", one_of(units.SPEED), ("speed_rpm", "speed_rad_s", "speed_Hz")),
    *(Column(name, one_of(of), (NAMES[name],), required=False) for name, (_, of) in COEFFICIENTS.items()),
)


def _two(value: object) -> object:
    if isinstance(value, list) and len(value) != 2:
        raise ValueError("a number, or two: [x, y]")
    return tuple(value) if isinstance(value, list) else (value, value)


_Written = float | Annotated[list[float], Field(min_length=2, max_length=2)]
OneOrTwo = Annotated[tuple[NotNegative, NotNegative], BeforeValidator(_two, json_schema_input_type=_Written)]


class _SupportKeys(Place):
    tilting_stiffness: NotNegative = key(
        "moment against a tilt of the shaft", "tilting_stiffness_N_m_per_rad", 0.0
    )
    kind: Literal["bearing", "seal"] = key("which it is, where it is another one", default="bearing")
    pedestal_mass: NotNegative = key("mass of what it stands on", "pedestal_mass_kg", 0.0, units=units.MASS)
    pedestal_stiffness: OneOrTwo | None = key(
        "its stiffness; one number, or two for x and y",
        "pedestal_stiffness_N_per_m",
        None,
        units=units.STIFFNESS,
    )
    pedestal_damping: OneOrTwo = key(
        "its damping; one number, or two for x and y",
        "pedestal_damping_N_s_per_m",
        (0.0, 0.0),
        units=units.DAMPING,
    )
    table: Text | None = key("a table of these coefficients over speed", default=None)

    @property
    def constants(self) -> dict[str, FloatArray]:
        """The coefficients that are written here."""
        return {name: np.array(value) for name in NAMES if (value := getattr(self, name)) is not None}

    @property
    def pedestal(self) -> Pedestal | None:
        """What it stands on."""
        if self.pedestal_stiffness is None:
            return None
        return Pedestal(self.pedestal_mass, self.pedestal_stiffness, self.pedestal_damping)

    def wrong(self) -> Iterator[tuple[str, str]]:
        """A bearing that pushes outwards, and a pedestal of no stiffness."""
        for name, value in self.constants.items():
            if self.kind == "bearing" and name in _DIAGONAL and value < 0:
                yield name, OUTWARDS
        if self.pedestal_stiffness is None and (self.pedestal_mass or any(self.pedestal_damping)):
            yield "pedestal_stiffness", "the stiffness of the pedestal"


def _coefficient(name: str) -> Any:  # noqa: ANN401
    about, names = f"{name}, the same in all directions", NAMES[name]
    if name not in ENTRIES:
        motion = "displacement" if name[0] == "k" else "velocity"
        about = f"force in {name[1]} against a {motion} in {name[2]}; also `{name}` alone, in SI"
        names += f" {name}"
    return Number | None, key(about, names, None, units=COEFFICIENTS[name][1])


SupportKeys = create_model(
    "SupportKeys", __base__=_SupportKeys, **{name: _coefficient(name) for name in NAMES}
)


class SealKeys(SupportKeys):  # type: ignore[misc, valid-type]
    """Keys of a `[[seal]]`."""

    kind: Literal["seal"] = key("which it is", default="seal")


KEYS: dict[str, Any] = {"bearing": SupportKeys, "seal": SealKeys, **forces.KEYS}
_TABLES: dict[str, Any] = {
    kind.name: (GenericAlias(list, (KEYS[kind.name],)), key(kind.about, default=[]))
    for kind in (*KINDS, *FORCES)
}
Attached = create_model("Attached", __base__=Settings, **_TABLES)
"""Settings of a file with tables of bearings, seals and forces."""


def read_attached(
    file: Settings, at: Places, folder: Path, problems: Problems
) -> tuple[list[Support], list[NodeForce]]:
    """Supports and forces of a file, of which tables are named from its folder."""
    supports, loads = [], []
    for kind in KINDS:
        items = getattr(file, kind.name)
        supports += each(problems, items, kind.name, lambda item: _support(item, at(item), folder))
    for kind in FORCES:
        items = getattr(file, kind.name)
        loads += each(problems, items, kind.name, lambda item: read_force(item, at(item)))
    return supports, loads


def _support(item: _SupportKeys, node: int, folder: Path) -> Support:
    values, speeds = item.constants, np.empty(0)
    if item.table is not None:
        table = _over_speed(folder / item.table, item.kind)
        speeds = table.numbers("speed")
        columns = {name: table.numbers(name) for name in NAMES if name in table}
        if twice := values.keys() & columns:
            raise ValueError(f"{NAMES[min(twice)]} once: {table.source} has this column, too")
        values |= columns
    if not values:
        raise ValueError("its stiffness is missing, or its damping, here and in a table over speed")
    for quantity, entries in ENTRIES.items():
        used = {*entries} & values.keys()
        if used and (quantity in values or len({entries[0], entries[3]} & used) == 1):
            both = listing([NAMES[entries[0]], NAMES[entries[3]]], "and")
            raise ValueError(f"either {NAMES[quantity]}, or both {both}")
    stiffness, damping = (_matrices(quantity, values) for quantity in ENTRIES)
    rest = tuple(speeds), item.pedestal, item.kind, item.tilting_stiffness
    return Support(node, stiffness, damping, item.name, *rest)


def _matrices(quantity: str, values: Mapping[str, FloatArray]) -> FloatArray:
    """Stiffness or damping: a number, or over speed (n,), or a matrix (2, 2) behind."""
    if {*ENTRIES[quantity]}.isdisjoint(values):
        return np.asarray(values.get(quantity, 0.0))[()]
    entries = np.broadcast_arrays(*(values.get(name, 0.0) for name in ENTRIES[quantity]))
    return np.stack(entries, axis=-1).reshape(*entries[0].shape, 2, 2)


def _over_speed(path: Path, kind: str) -> Table:
    """A table of coefficients."""
    problems = Problems()
    table = problems.need(read_table(path, kind, COLUMNS, problems))
    speed = table.numbers("speed")
    table.must_be("speed", speed >= 0, "a speed of 0 or more")
    rising = np.insert(~(np.diff(speed) <= 0), 0, True)
    table.must_be("speed", rising, "a speed above that of the row before (ascending, each once)")
    for name in _DIAGONAL if kind == "bearing" else ():
        table.must_be(name, table.numbers(name) >= 0, OUTWARDS)
    if len(table) == 1:
        table.complain(0, "speed", "two speeds at least: a table says how coefficients change")
    problems.stop()
    return table


def support_tables(
    supports: Sequence[Support], path: Path, *, ordered: bool = False
) -> tuple[dict[str, list[dict[str, Any]]], dict[Path, bytes]]:
    """Supports as tables of a file, in SI, and those over speed as files beside it.

    Kinds are read one after another: where they are mixed (or `ordered`), all stand under `[[bearing]]`.
    """
    kinds = [support.kind for support in supports]
    ordered = ordered or kinds != sorted(kinds)
    tables: dict[str, list[dict[str, Any]]] = {}
    files: dict[Path, bytes] = {}
    for number, support in enumerate(supports, start=1):
        section = "bearing" if ordered else support.kind
        values, columns = vars(support) | dict.fromkeys((*ENTRIES, "table")), _columns(support)
        if support.speeds:
            table = path.with_name(f"{path.stem}_{support.kind}_{number}.csv")
            names, rows = (
                [NAMES[name] for name in columns],
                zip(support.speeds, *columns.values(), strict=True),
            )
            values["table"], files[table] = table.name, csv_bytes((), ["speed_rad_s", *names], [*rows])
        else:
            values |= {name: value for name, (value,) in columns.items()}
        if stand := support.pedestal:
            pairs = {f"pedestal_{name}": stand.xy(name) for name in ENTRIES}
            values |= {"pedestal_mass": stand.mass, **pairs}
        tables.setdefault(section, []).append(in_si(KEYS[section], values))
    return tables, files


def _columns(support: Support) -> dict[str, list[float]]:
    """Its coefficients at its speeds, or one each; those of matrices where any direction differs."""
    out: dict[str, list[float]] = {}
    for (quantity, entries), matrices in zip(ENTRIES.items(), support.table, strict=True):
        xx, xy, yx, yy = matrices.reshape(-1, 4).T.tolist()
        alike = xx == yy and not any((*xy, *yx))
        out |= {quantity: xx} if alike else dict(zip(entries, (xx, xy, yx, yy), strict=True))
    return out
