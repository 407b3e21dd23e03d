"""Numbers of a rotor by name, such as `bearing[1].kxx` or `disc.scale`; other values of them; error bands.

A path names a kind, which of its items, one of their numbers, and what to do with it: set, `.scale` or
`.offset`. Numbers of an item are read as arrays by key, changed there, and an item is built of them again.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from fem.rotor import KINDS, Calibration, Disc, Pedestal, Rotor, Support, is_reading
from rotorid.base.arrays import AnyArray, FloatArray
from rotorid.base.checks import number
from rotorid.base.registry import names
from rotorid.base.suggestions import one_of

__all__ = [
    "NORMAL_95",
    "Calibration",
    "as_change",
    "as_they_stand",
    "band",
    "expand",
    "is_reading",
    "nearest_modes",
    "numbers_of",
    "parameter_value",
    "spread",
    "typical_size",
    "with_changes",
    "with_parameters",
]

NORMAL_95 = 1.959964
"""Standard deviations from the middle to the ends of 95 %."""
_TABLED = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
_STAND = ("pedestal_mass", *(f"pedestal_{name}_{axis}" for name in ("stiffness", "damping") for axis in "xy"))
_DISC = ("mass", "polar_inertia", "diametral_inertia")
_MATERIAL = ("youngs_modulus", "density", "poisson_ratio", "material_damping")
_SUPPORT = {
    **{name: (name,) for name in (*_TABLED, "tilting_stiffness", *_STAND)},
    "stiffness": ("kxx", "kyy"),
    "damping": ("cxx", "cyy"),
    "pedestal_stiffness": _STAND[1:3],
    "pedestal_damping": _STAND[3:],
}
_KEYS: dict[str, dict[str, tuple[str, ...]]] = {
    **dict.fromkeys(names(KINDS), _SUPPORT),
    "disc": {name: (name,) for name in _DISC} | {"scale": _DISC},
    "material": {name: (name,) for name in _MATERIAL},
}
"""By kind and name: keys of `_numbers`."""
_READINGS = ("probe[NAME].angle", "probe[NAME].gain", "key_phasor.angle")
_SUFFIXES = ("", "scale", "offset")  # in the order in which they act


class _Parameter(NamedTuple):
    """A path, read: items of its kind by place in `rotor.supports` or `rotor.discs`, keys, and the suffix."""

    path: str
    kind: str
    items: dict[int, Any]
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
          `pedestal_damping` likewise, of those that stand on a pedestal.
        - `disc[2].mass`, `.polar_inertia`, `.diametral_inertia`; `disc[2].scale`, a factor on all three.
        - `material.youngs_modulus`, `.density`, `.poisson_ratio`, `.material_damping` of all elements.
        - Any of these with `.scale`: a factor, 1 as the rotor stands, on all rows of a table, and on all
          four entries of `stiffness` or `damping`.
        - A support's stiffness and damping with `.offset`: it is added at all speeds, 0 as the rotor stands.
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
        for i in parameter.items:
            changes[parameter.kind, i].append((parameter, number(value, path, signed=True)))
    new: dict[str, Any] = {"discs": list(rotor.discs), "supports": list(rotor.supports)}
    for (kind, i), of_item in changes.items():
        item = _items(rotor, kind)[i]
        numbers = _changed(_numbers(item), of_item)
        if kind == "material":
            new |= numbers
        elif kind == "disc":
            new["discs"][i] = replace(item, **{name: value[0] for name, value in numbers.items()})
        else:
            new["supports"][i] = _support(item, numbers)
    return replace(rotor, **new)


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
    return f"{path}.offset" if not parameter.suffix and parameter.keys[0] in _TABLED else path


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
            if other.endswith(".offset") and numbers[i] & numbers[j]:
                if not numbers[i] <= numbers[j]:
                    raise ValueError(f"{other} adds to more numbers than {path} multiplies")
                T[i, j] = -added / scale
    return T


def numbers_of(rotor: Rotor, path: str) -> frozenset[tuple[str, int, str]]:
    """Which numbers a parameter sets, scales or adds to: kind, place, name of each; none of a reading."""
    parameter = _parameter(rotor, path)
    return frozenset((parameter.kind, i, key) for i in parameter.items for key in parameter.keys)


def parameter_value(rotor: Rotor, path: str) -> float:
    """The value of a parameter, see `with_parameters`: 1 of a scale or gain, 0 of what is added or an angle.

    Raises
    ------
    ValueError
        For a path that the rotor does not have, a table, and several numbers that are not the same.
    """
    parameter = _parameter(rotor, path)
    if parameter.suffix:
        return float(parameter.suffix == "scale")
    items = [_numbers(item) for item in parameter.items.values()]
    values = [_single(path, key, numbers) for numbers in items for key in parameter.keys]
    if max(values) > min(values):
        raise ValueError(f"{path} is several numbers, {min(values):.6g} to {max(values):.6g}: {path}.scale")
    return values[0]


def typical_size(rotor: Rotor, path: str) -> float:
    """A size of a parameter for steps of differences, above 0, in its unit.

    The number itself; for a zero the largest of its kind there (of kxy: of the support's stiffness), or 1;
    1 for a scale, 1 degree for an angle.

    Raises
    ------
    ValueError
        For a path that the rotor does not have.
    """
    parameter = _parameter(rotor, path)
    if parameter.suffix == "scale" or not parameter.keys:
        return 1.0
    items = [_numbers(item) for item in parameter.items.values()]
    sizes = (
        max(float(np.abs(numbers[key]).max()) for numbers in items for key in keys)
        for keys in (parameter.keys, _alike(parameter.keys))
    )
    return next(filter(None, sizes), 1.0)


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
    if probes and is_reading(path.replace("[*]", "[any]")) and "]" in path:
        name, rest = path.removeprefix("probe[").split("]")
        one_of(name, f"{path}: the probe", ("*", *probes))
        return tuple(f"probe[{probe}]{rest}" for probe in probes if name in ("*", probe))
    parameter = _parameter(rotor, path)
    if "[*]" not in path:
        return (path,)
    places = list(_items(rotor, parameter.kind))
    return tuple(path.replace("*", str(places.index(i) + 1)) for i in parameter.items)


def _parameter(rotor: Rotor, path: str) -> _Parameter:
    """A path, read and checked."""
    if is_reading(path):
        return _Parameter(path, "", {}, (), "scale" if path.endswith("gain") else "offset")
    match = re.fullmatch(r"([^.\[\]]+)(?:\[(.*)\])?\.([^.\[\]]+)(?:\.([^\[\]]+))?", path)
    if match is None:
        raise ValueError(f"{path!r} is no parameter: one looks like bearing[1].kxx or material.density.scale")
    kind, selection, name, suffix = match.groups(default="")
    of_kind = _KEYS[one_of(kind, f"{path}: the kind", (*_KEYS, *_READINGS))]
    keys = of_kind[one_of(name, f"{path}: of a {kind},", tuple(of_kind))]
    if suffix:
        one_of(suffix, f"{path}: the suffix", _SUFFIXES[1:] if keys[0] in _TABLED else ("scale",))
    if name == "scale":
        suffix = name
    elif suffix == "scale" and len(keys) > 1:
        keys = _alike(keys)
    return _Parameter(path, kind, _selected(rotor, path, kind, selection, keys), keys, suffix)


def _alike(keys: tuple[str, ...]) -> tuple[str, ...]:
    """All entries of the stiffness or damping that a key is of, or the keys as they are."""
    return tuple(key for key in _TABLED if key[0] == keys[0][0]) if keys[0] in _TABLED else keys


def _items(rotor: Rotor, kind: str) -> dict[int, Any]:
    """All of a kind by their place in `rotor.discs` or `rotor.supports`; the rotor itself: its material."""
    items = {"material": [rotor], "disc": rotor.discs}.get(kind, rotor.supports)
    return {i: item for i, item in enumerate(items) if getattr(item, "kind", kind) == kind}


def _selected(rotor: Rotor, path: str, kind: str, selection: str, keys: tuple[str, ...]) -> dict[int, Any]:
    """Items that stand in brackets, by number or a name that comes once; all without or with *."""
    items = _items(rotor, kind)
    if not items:
        raise ValueError(f"{path}: the rotor has no {kind}")
    if selection not in ("", "*"):
        called = {str(n): i for n, i in enumerate(items, start=1)}
        by_name = [getattr(item, "name", "") for item in items.values()]
        for i, name in zip(items, by_name, strict=True):
            if name and by_name.count(name) == 1:
                called.setdefault(name, i)
        parts = [selection] if selection in called else map(str.strip, selection.split(","))
        places = [called[one_of(part, f"{path}: the {kind}", tuple(called))] for part in parts]
        items = {i: items[i] for i in places}
    if keys[0] in _STAND:
        items = {i: support for i, support in items.items() if support.pedestal}
        if not items:
            raise ValueError(f"{path}: the {kind} stands on no pedestal")
    return items


def _numbers(item: Any) -> dict[str, FloatArray]:  # noqa: ANN401
    """Numbers of an item by key, each of shape (n,): rows of a table, elements of the shaft, or one."""
    if not isinstance(item, Support):
        keys = _DISC if isinstance(item, Disc) else _MATERIAL
        return {name: np.atleast_1d(getattr(item, name)) for name in keys}
    table = np.moveaxis(np.array(item.at(item.speeds or (0.0,))), 1, -1)
    numbers = dict(zip(_TABLED, table.reshape(8, -1), strict=True))
    numbers["tilting_stiffness"] = np.array([item.tilting_stiffness])
    if stand := item.pedestal:
        values = (stand.mass, *stand.xy("stiffness"), *stand.xy("damping"))
        numbers |= zip(_STAND, np.reshape(values, (5, 1)), strict=True)
    return numbers


def _single(path: str, key: str, numbers: Mapping[str, FloatArray]) -> float:
    """The one value of a number; refused where no plain value can stand for it."""
    values = numbers[key]
    if key in _TABLED and values.size > 1:
        raise ValueError(f"{path} is a table: {path}.scale")
    if np.ptp(values):
        raise ValueError(f"{path} differs along the shaft: {path}.scale")
    return float(values[0])


def _changed(
    numbers: dict[str, FloatArray], changes: Sequence[tuple[_Parameter, float]]
) -> dict[str, FloatArray]:
    """Numbers of an item with values set, then scaled, then added to."""
    given: set[str] = set()
    for parameter, value in sorted(changes, key=lambda change: _SUFFIXES.index(change[0].suffix)):
        for key in parameter.keys:
            if parameter.suffix == "scale":
                numbers[key] = numbers[key] * value
            elif parameter.suffix == "offset":
                numbers[key] = numbers[key] + value
            elif key in given:
                raise ValueError(f"{parameter.path}: another parameter has this number, too")
            else:
                _single(parameter.path, key, numbers)
                numbers[key] = np.full_like(numbers[key], value)
                given.add(key)
    return numbers


def _support(support: Support, numbers: Mapping[str, FloatArray]) -> Support:
    """The support with these numbers."""
    table = np.moveaxis(np.reshape([numbers[key] for key in _TABLED], (2, 2, 2, -1)), -1, 1)
    stiffness, damping = table if support.speeds else table[:, 0]
    stand = support.pedestal
    if stand:
        mass, kx, ky, cx, cy = (numbers[key][0] for key in _STAND)
        stand = Pedestal(mass, (kx, ky), (cx, cy))
    tilting = numbers["tilting_stiffness"][0]
    return replace(support, stiffness=stiffness, damping=damping, pedestal=stand, tilting_stiffness=tilting)


def spread(rotor: Rotor, evaluate: Callable[[Rotor], AnyArray]) -> FloatArray:
    """Standard deviations of what a rotor gives over its calibrated parameters.

    The parameters are changed up and down by √3 times each principal column of the covariance (Gauss and
    Hermite's points): Σ (f₊ − f₋)² / 12 + (f₊ + f₋ − 2 f)² / 18, exact for a parabola along each column.

    Parameters
    ----------
    rotor
        With its calibration.
    evaluate
        Gives an array, real or complex, the same shape whatever the parameters.

    Returns
    -------
    Of that shape; NaN where any of them is.

    Raises
    ------
    ValueError
        For a rotor without a calibration, parameters that cannot be changed so far, arrays of another shape.
    """
    if rotor.calibration is None:
        raise ValueError("the rotor has no calibration")
    paths, middle = rotor.calibration.names, np.asarray(evaluate(rotor))
    variance = np.zeros(middle.shape)
    for column in np.sqrt(3.0) * rotor.calibration.columns().T:
        up, down = (
            np.asarray(evaluate(with_changes(rotor, dict(zip(paths, step, strict=True)))))
            for step in (column, -column)
        )
        if not up.shape == down.shape == middle.shape:
            raise ValueError("their number changes")
        variance += np.abs(up - down) ** 2 / 12 + np.abs(up + down - 2 * middle) ** 2 / 18
    return np.sqrt(variance)


def band(
    rotor: Rotor, what: str, evaluate: Callable[[Rotor], AnyArray]
) -> tuple[FloatArray | None, tuple[str, ...]]:
    """`spread`, or None without a calibration and where it cannot be given, and what is to be said.

    Parameters
    ----------
    rotor, evaluate
        As `spread`.
    what
        The values' name in the sentences: "the critical speeds".
    """
    if rotor.calibration is None:
        return None, ()
    try:
        std = spread(rotor, evaluate)
    except ValueError as error:
        return None, (f"no error bands of {what}: within the errors of the calibration, {error}",)
    sentences = []
    if rotor.calibration.needs_trial_run:
        sentences.append("the readings of the calibration contradict the model: its errors exceed the bands")
    rough = np.count_nonzero(std > 0.15 * np.abs(evaluate(rotor)))  # no longer linear nor symmetric
    if rough:
        sentences.append(
            f"{rough} of {std.size} error bands of {what} are wider than ±30 % and rough: a "
            "resonance that moves with the parameters is not linear in them"
        )
    return std, tuple(sentences)


def nearest_modes(middle: FloatArray, other: FloatArray) -> FloatArray:
    """Frequencies of modes over speed, shape (S, n), in the order of those that they are nearest to.

    Two modes that exchange their numbers with the parameters keep them so. As they are if n differs.
    """
    from scipy.optimize import linear_sum_assignment

    if other.shape != middle.shape:
        return other
    apart = np.nan_to_num(middle[:, :, None] - other[:, None, :]) ** 2
    return np.asarray(other[:, linear_sum_assignment(apart.sum(axis=0))[1]])
