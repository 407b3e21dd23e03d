"""Numbers of a rotor by name, such as `bearing[1].kxx` or `disc.scale`, and a rotor with other values."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from fem.model.calibration import is_reading
from fem.model.rotor import Rotor
from fem.model.supports import KINDS, Pedestal, Support
from rotorid.base.arrays import FloatArray
from rotorid.base.checks import number
from rotorid.base.registry import find, names
from rotorid.base.suggestions import did_you_mean, one_of
from rotorid.base.text import counted, listing

SLOPE_END, CURVE_END, CURVE_STEP = 1e4, 3000.0, 3000.0 / 96
"""rad/s: where a table ends that `.slope` or `.curve` makes of a constant, and the latter's steps."""
_POWERS = ("offset", "slope", "curve")
"""Suffixes of what is added, by the power of speed."""
_TABLED = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
_STAND = tuple(f"pedestal_{name}_{axis}" for name in ("stiffness", "damping") for axis in "xy")
_DISC = ("mass", "polar_inertia", "diametral_inertia")
_MATERIAL = ("youngs_modulus", "density", "poisson_ratio", "material_damping")
_GROUPS = {"stiffness": ("kxx", "kyy"), "damping": ("cxx", "cyy")}
_SUPPORT = {
    **{name: (name,) for name in (*_TABLED, "tilting_stiffness", "pedestal_mass", *_STAND)},
    **_GROUPS,
    "pedestal_stiffness": _STAND[:2],
    "pedestal_damping": _STAND[2:],
}
_FIELDS: dict[str, dict[str, tuple[str, ...]]] = {
    **dict.fromkeys(names(KINDS), _SUPPORT),
    "disc": {name: (name,) for name in _DISC} | {"scale": _DISC},
    "material": {name: (name,) for name in _MATERIAL},
    "probe": {"angle": (), "gain": ()},
    "key_phasor": {"angle": ()},
}
"""By kind and name: keys of `_numbers`."""


class _Parameter(NamedTuple):
    """A path, read: places in `rotor.supports` or `rotor.discs`, which of their numbers, and the suffix."""

    path: str
    kind: str
    items: tuple[int, ...]
    keys: tuple[str, ...]
    suffix: str


def with_parameters(rotor: Rotor, values: Mapping[str, float]) -> Rotor:
    """The rotor with other values of these parameters, set together: their order does not matter.

    Parameters
    ----------
    rotor
        Stays as it is.
    values
        By path, in SI:

        - `bearing[1].kxx`, … `cyy`: the first bearing's, counted within its kind in the order of
          `rotor.supports`; `bearing[DE].kxx` by name, `bearing[1,2].kxx` and `bearing.kxx` one value for
          several or all; `seal[…]` likewise. `stiffness` and `damping` are both directions of an isotropic
          one; `tilting_stiffness`; `pedestal_mass`; `pedestal_stiffness`, `pedestal_stiffness_x`, `…_y`;
          `pedestal_damping` likewise.
        - `disc[2].mass`, `.polar_inertia`, `.diametral_inertia`; `disc[2].scale`, a factor on all three.
        - `material.youngs_modulus`, `.density`, `.poisson_ratio`, `.material_damping` of all elements.
        - Any of these with `.scale`: a factor, 1 as the rotor stands, on all rows of a table, and on all
          four entries of `stiffness` or `damping`.
        - A support's stiffness and damping with `.offset`, `.slope`, `.curve`: a, a·Ω, a·Ω² is added, 0 as
          the rotor stands. Of a constant `.slope` makes a table of 0 and 1e4 rad/s, `.curve` one of 97
          speeds from 0 to 3000 rad/s (a given table is cut into steps of at most 31.25 rad/s); both end
          before a bearing's kxx, kyy, cxx or cyy falls below 0.
        - Those of `is_reading` change nothing.

        Values are set first, then scaled, then added to; factors multiply, what is added adds up.

    Raises
    ------
    ValueError
        In one sentence: for a path that the rotor does not have, a plain value of a tabulated coefficient
        or of a material that differs along the shaft, a number given twice, an impossible value.
    """
    changes: dict[tuple[str, int], list[tuple[_Parameter, float]]] = defaultdict(list)
    for path, value in values.items():
        parameter = _parameter(rotor, path)
        for item in parameter.items:
            changes[parameter.kind, item].append((parameter, number(value, path, signed=True)))
    discs, supports = list(rotor.discs), list(rotor.supports)
    material: dict[str, Any] = {}
    for (kind, i), own in changes.items():
        new: dict[str, Any] = _set_and_scaled(rotor, i, own)
        if kind == "material":
            material = new
        elif kind == "disc":
            discs[i] = replace(discs[i], **{name: value[0] for name, value in new.items()})
        else:
            supports[i] = _support(supports[i], new, own)
    return replace(rotor, discs=discs, supports=supports, **material)


def with_changes(rotor: Rotor, changes: Mapping[str, float]) -> Rotor:
    """The rotor with parameters changed by so much from where they stand; tabulated coefficients too.

    Raises
    ------
    ValueError
        As `with_parameters`, and as `parameter_value` of what is no coefficient of a support.
    """
    values: dict[str, float] = defaultdict(float)
    for path, change in changes.items():
        to = as_change(rotor, path)
        values[to] += parameter_value(rotor, to) + change
    return with_parameters(rotor, values)


def as_change(rotor: Rotor, path: str) -> str:
    """The parameter by which this one can be changed from where it stands: `.offset` of a coefficient."""
    parameter = _parameter(rotor, path)
    return f"{path}.offset" if not parameter.suffix and {*parameter.keys} & {*_TABLED} else path


def as_they_stand(rotor: Rotor, values: Mapping[str, float]) -> FloatArray:
    """Derivatives (n, n) of changes, as `with_changes` makes them of the rotor with these values, by these.

    A scale s is 1 there, and multiplies what is added to the same numbers, a, too: ds' = ds / s,
    da' = da − a ds / s.

    Raises
    ------
    ValueError
        For what is added to more numbers than such a scale multiplies.
    """
    T = np.eye(len(values))
    numbers = [numbers_of(rotor, path) for path in values]
    for j, (path, scale) in enumerate(values.items()):
        if not path.endswith(".scale"):
            continue
        scale = scale or 1.0  # with nothing left of the numbers
        T[j, j] = 1 / scale
        for i, (other, added) in enumerate(values.items()):
            if other.rpartition(".")[2] in _POWERS and numbers[i] & numbers[j]:
                if not numbers[i] <= numbers[j]:
                    raise ValueError(f"{other} adds to more numbers than {path} multiplies")
                T[i, j] = -added / scale
    return T


def numbers_of(rotor: Rotor, path: str) -> frozenset[tuple[str, int, str]]:
    """Which numbers a parameter sets, scales or adds to: kind, place, name of each; none of a reading."""
    _, kind, items, keys, _ = _parameter(rotor, path)
    return frozenset((kind, i, key) for i in items for key in keys)


def parameter_value(rotor: Rotor, path: str) -> float:
    """The value of a parameter, see `with_parameters`: 1 of a scale or gain, 0 of what is added or an angle.

    Raises
    ------
    ValueError
        For a path that the rotor does not have, a table, and several numbers that are not the same.
    """
    parameter = _parameter(rotor, path)
    if parameter.suffix or not parameter.keys:
        return float(parameter.suffix == "scale" or path.endswith(".gain"))
    found = np.unique(_values(rotor, parameter, parameter.keys, plain=True))
    if len(found) > 1:
        raise ValueError(f"{path} is several numbers, {found[0]:.6g} to {found[-1]:.6g}: {path}.scale")
    return float(found[0])


def typical_size(rotor: Rotor, path: str) -> float:
    """A size of a parameter for steps of differences, above 0, in its unit.

    The number itself; for a zero the largest of its kind there (of kxy: of the support's stiffness), or 1;
    1 for a scale, 1 degree for an angle; for `.slope` and `.curve` the coefficient's size over 1000 rad/s
    and its square.

    Raises
    ------
    ValueError
        For a path that the rotor does not have.
    """
    parameter = _parameter(rotor, path)
    keys = parameter.keys
    if parameter.suffix == "scale" or not keys:
        return 1.0
    alike = tuple(name for name in _TABLED if name[0] == keys[0][0]) if keys[0] in _TABLED else keys
    sizes = (float(np.abs(_values(rotor, parameter, which)).max()) for which in (keys, alike))
    return next(filter(None, sizes), 1.0) / 1000.0 ** (_POWERS.index(parameter.suffix or "offset"))


def expand(rotor: Rotor, path: str, probes: Sequence[str] = ()) -> tuple[str, ...]:
    """Paths of the single parameters that a path with `[*]` stands for; another one, checked, as it is.

    Parameters
    ----------
    rotor
        With the supports and discs; for pedestals only those supports count that stand on one.
    path
        Such as `bearing[*].kxx` or `probe[*].angle`.
    probes
        Names of the probes; without them names of probes are not checked.

    Raises
    ------
    ValueError
        For a path that the rotor does not have, or a probe that is not there.
    """
    kind, selection, rest, *_ = _split(path)
    if kind == "probe" and probes and selection is not None:
        one_of(selection, f"{path}: the probe", ("*", *probes))
        return tuple(f"probe[{name}].{rest}" for name in probes if selection in ("*", name))
    if selection != "*":
        _parameter(rotor, path)
        return (path,)
    own = _of_kind(rotor, kind)
    return tuple(f"{kind}[{own.index(i) + 1}].{rest}" for i in _parameter(rotor, f"{kind}.{rest}").items)


def _split(path: str) -> tuple[str, str | None, str, tuple[str, ...], str]:
    """Kind, what stands in brackets (None: nothing), the rest, and its keys of `_numbers` and suffix."""
    found = re.fullmatch(r"([^.\[\]]+)(?:\[(.*)\])?\.([^\[\]]+)", path)
    if found is None:
        raise ValueError(f"{path!r} is no parameter: one looks like bearing[1].kxx or material.density.scale")
    kind, selection, rest = found.groups()
    fields = _FIELDS[one_of(kind, f"{path}: the kind", tuple(_FIELDS))]
    name, dot, suffix = rest.partition(".")
    keys = fields[one_of(name, f"{path}: of a {kind},", tuple(fields))]
    if dot:
        may = ("scale", *_POWERS) if name in _GROUPS or name in _TABLED else ("scale",)
        one_of(suffix, f"{path}: the suffix", may if keys and name != "scale" else ())
    if suffix == "scale" and name in _GROUPS:
        keys = tuple(key for key in _TABLED if key[0] == keys[0][0])
    return kind, selection, rest, keys, "scale" if name == "scale" else suffix


def _parameter(rotor: Rotor, path: str) -> _Parameter:
    kind, selection, rest, keys, suffix = _split(path)
    if kind in ("probe", "key_phasor", "material"):
        if not is_reading(path) and (kind != "material" or selection is not None):
            raise ValueError(f"{path}: write {'probe[NAME]' if kind == 'probe' else kind}.{rest}")
        return _Parameter(path, kind, (0,) if keys else (), keys, suffix)
    items = _selected(rotor, path, kind, selection)
    there = tuple(i for i in items if keys[0][:8] != "pedestal" or rotor.supports[i].pedestal)
    if not there or (selection is not None and there != items):
        raise ValueError(f"{path}: the {kind} stands on no pedestal")
    return _Parameter(path, kind, there, keys, suffix)


def _of_kind(rotor: Rotor, kind: str) -> list[int]:
    """Places in `rotor.discs` or `rotor.supports`."""
    if kind == "disc":
        return list(range(len(rotor.discs)))
    return [i for i, support in enumerate(rotor.supports) if support.kind == kind]


def _selected(rotor: Rotor, path: str, kind: str, selection: str | None) -> tuple[int, ...]:
    own = _of_kind(rotor, kind)
    if not own:
        raise ValueError(f"{path}: the rotor has no {kind}")
    if selection is None:
        return tuple(own)
    called = [(rotor.discs if kind == "disc" else rotor.supports)[i].name for i in own]
    known = [*map(str, range(1, len(own) + 1)), *filter(None, called)]
    found = []
    for part in [selection] if selection in called else map(str.strip, selection.split(",")):
        if known.count(part) != 1:
            what = "several are" if part in known else "none is"
            raise ValueError(
                f"{path}: of {counted(len(own), kind)} {what} called {part!r}"
                f"{did_you_mean(part, known)}: {listing(known)}"
            )
        found.append(own[called.index(part) if part in called else int(part) - 1])
    if len({*found}) < len(found):
        raise ValueError(f"{path}: it names one {kind} twice")
    return tuple(found)


def _numbers(rotor: Rotor, kind: str, i: int) -> dict[str, FloatArray]:
    """Numbers of an item by name, each of shape (n,): rows of a table, elements of the shaft, or one."""
    if kind in ("material", "disc"):
        item, keys = (rotor, _MATERIAL) if kind == "material" else (rotor.discs[i], _DISC)
        return {name: np.atleast_1d(getattr(item, name)) for name in keys}
    support = rotor.supports[i]
    both = np.stack(support.at(support.speeds or (0.0,)))
    own = dict(zip(_TABLED, both.transpose(0, 2, 3, 1).reshape(8, -1), strict=True))
    own["tilting_stiffness"] = np.array([support.tilting_stiffness])
    if (stand := support.pedestal) is not None:
        own["pedestal_mass"] = np.array([stand.mass])
        values = (*stand.xy("stiffness"), *stand.xy("damping"))
        own |= {name: np.array([value]) for name, value in zip(_STAND, values, strict=True)}
    return own


def _values(rotor: Rotor, parameter: _Parameter, keys: Sequence[str], *, plain: bool = False) -> FloatArray:
    """All numbers of a parameter, flat; `plain`: refused where no plain value can stand for them."""
    out = []
    for numbers in (_numbers(rotor, parameter.kind, i) for i in parameter.items):
        for key in keys:
            if plain and key in _TABLED and len(numbers[key]) > 1:
                raise ValueError(f"{parameter.path} is a table: {parameter.path}.scale")
            if plain and np.ptp(numbers[key]):
                raise ValueError(f"{parameter.path} differs along the shaft: {parameter.path}.scale")
            out.append(numbers[key])
    return np.concatenate(out)


def _set_and_scaled(
    rotor: Rotor, i: int, changes: Sequence[tuple[_Parameter, float]]
) -> dict[str, FloatArray]:
    """Numbers of an item with values set and then scaled."""
    numbers = _numbers(rotor, changes[0][0].kind, i)
    given: set[str] = set()
    for parameter, value in changes:
        if not parameter.suffix:
            _values(rotor, parameter, parameter.keys, plain=True)
            if given & {*parameter.keys}:
                raise ValueError(f"{parameter.path}: another parameter has this number, too")
            given |= {*parameter.keys}
            numbers |= {key: np.full_like(numbers[key], value) for key in parameter.keys}
    for parameter, value in changes:
        if parameter.suffix == "scale":
            numbers |= {key: numbers[key] * value for key in parameter.keys}
    return numbers


def _support(
    support: Support, numbers: dict[str, FloatArray], changes: Sequence[tuple[_Parameter, float]]
) -> Support:
    """The support with these numbers and what is added to them over speed."""
    added = np.zeros((3, 8))  # by power of speed
    for parameter, value in changes:
        if parameter.suffix in _POWERS:
            added[_POWERS.index(parameter.suffix), [_TABLED.index(key) for key in parameter.keys]] += value
    table = np.array([numbers[name] for name in _TABLED])
    speeds = _knots(support, table, added)
    omega = np.array(speeds or (0.0,))
    if len(omega) != table.shape[1]:
        table = np.array([np.interp(omega, support.speeds or (0.0,), row) for row in table])
    table += added.T @ omega ** np.arange(3)[:, None]
    new: dict[str, Any] = dict(zip(_GROUPS, table.reshape(2, 2, 2, -1).transpose(0, 3, 1, 2), strict=True))
    if not speeds:
        new = {name: value[0] for name, value in new.items()}
    if support.pedestal is not None:
        mass, *stand = (float(numbers[key][0]) for key in ("pedestal_mass", *_STAND))
        new["pedestal"] = Pedestal(mass, (stand[0], stand[1]), (stand[2], stand[3]))
    return replace(support, **new, speeds=speeds, tilting_stiffness=float(numbers["tilting_stiffness"][0]))


def _knots(support: Support, table: FloatArray, added: FloatArray) -> tuple[float, ...]:
    """Speeds of its table with what is added, rad/s; none as long as it is constant."""
    if not added[1:].any():
        return support.speeds
    curved, speeds = added[2].any(), support.speeds
    if not speeds:
        end = CURVE_END if curved else SLOPE_END
        if find(KINDS, support.kind, "kind").function >= 0:
            whole = added + np.outer((1, 0, 0), table[:, 0])
            roots = np.concatenate([np.roots(whole[::-1, j]) for j in (0, 3, 4, 7)])
            end = min([end, *roots.real[(roots.imag == 0) & (roots.real > 0)] * (1 - 1e-9)])
        speeds = (0.0, float(end))
    parts = np.ceil(np.diff(speeds) / CURVE_STEP - 1e-9) if curved else np.ones(len(speeds) - 1)
    ends = np.concatenate(([0.0], np.cumsum(parts)))
    return tuple(np.interp(np.arange(ends[-1] + 1), ends, speeds).tolist())
