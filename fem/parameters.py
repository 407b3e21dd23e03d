"""Numbers of a rotor by name, such as `bearing[1].kxx` or `disc.scale`; other values of them; error bands.

A path names a kind, which of its items, one of their numbers, and what to do with it: set, `.scale` or
`.offset`. All numbers of a rotor are read as arrays, changed there, and the rotor is built of them again.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fem.rotor import KINDS, Pedestal, Rotor, is_reading
from rotorid.base.arrays import AnyArray, FloatArray, number
from rotorid.base.choices import names, one_of

_TABLED = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
_STAND = ("pedestal_mass", *(f"pedestal_{name}_{axis}" for name in ("stiffness", "damping") for axis in "xy"))
_DISC = ("mass", "polar_inertia", "diametral_inertia")
_MATERIAL = ("youngs_modulus", "density", "poisson_ratio", "material_damping")
_GROUPS = {
    "stiffness": ("kxx", "kyy"),
    "damping": ("cxx", "cyy"),
    "pedestal_stiffness": _STAND[1:3],
    "pedestal_damping": _STAND[3:],
    "scale": _DISC,
}
"""Names that stand for several keys."""
_SUPPORT = (*_TABLED, "tilting_stiffness", *_STAND, *[*_GROUPS][:-1])
_NAMES = {**dict.fromkeys(names(KINDS), _SUPPORT), "disc": (*_DISC, "scale"), "material": _MATERIAL}
"""By kind: keys of numbers, then names of groups."""
_READINGS = ("probe[NAME].angle", "probe[NAME].gain", "key_phasor.angle")
_ACTS: dict[str, Callable[..., FloatArray]] = {"": np.full_like, "scale": np.multiply, "offset": np.add}
"""What a suffix does to a number with a value, in the order in which they act."""
_Numbers = dict[tuple[str, int], dict[str, Any]]
"""By kind and place in `rotor.supports` or `rotor.discs`, and by key: rows of a table, elements, or one."""


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
        In one sentence: for a path that the rotor does not have, a plain value where a table or a material
        along the shaft has several, a number given twice, an impossible value.
    """
    numbers, given = {at: {**its} for at, its in _numbers(rotor).items()}, list[tuple[str, int, str]]()
    changes = [(path, *_parameter(rotor, path)) for path in values]
    for path, before, suffix in sorted(changes, key=lambda change: [*_ACTS].index(change[-1])):
        value = number(values[path], path, signed=True)
        if not suffix:
            given += before
            for each in before.values():
                _one(path, each)
            if len({*given}) < len(given):
                raise ValueError(f"{path}: another parameter has this number, too")
        for kind, i, key in before:
            item = numbers[kind, i]
            item[key] = _ACTS[suffix](item[key], value)
    changed = {at[:2] for change in changes for at in change[-2]}
    supports = list(rotor.supports)
    discs = [
        replace(disc, **numbers["disc", i]) if ("disc", i) in changed else disc
        for i, disc in enumerate(rotor.discs)
    ]
    for i, support in enumerate(supports):
        if (support.kind, i) in changed:
            its = tuple(numbers[support.kind, i].values())
            table = np.reshape(its[:8], (2, 2, 2, -1)).transpose(0, 3, 1, 2)
            k, c = table if support.speeds else table[:, 0]
            stand = Pedestal(its[9], its[10:12], its[12:]) if support.pedestal else None
            supports[i] = replace(support, stiffness=k, damping=c, pedestal=stand, tilting_stiffness=its[8])
    return replace(rotor, discs=discs, supports=supports, **numbers["material", 0])


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
    numbers, suffix = _parameter(rotor, path)
    return path if suffix or not any(key in _TABLED for *_, key in numbers) else f"{path}.offset"


def numbers_of(rotor: Rotor, path: str) -> frozenset[tuple[str, int, str]]:
    """Which numbers a parameter sets, scales or adds to: kind, place, name of each; none of a reading."""
    return frozenset(_parameter(rotor, path)[0])


def parameter_value(rotor: Rotor, path: str) -> float:
    """The value of a parameter, see `with_parameters`: 1 of a scale or gain, 0 of what is added or an angle.

    Raises
    ------
    ValueError
        For a path that the rotor does not have, and several numbers that are not the same.
    """
    numbers, suffix = _parameter(rotor, path)
    if suffix:
        return float(suffix == "scale")
    return _one(path, np.hstack([*numbers.values()]))


def _one(path: str, values: FloatArray) -> float:
    """The value that all of these have; refused where they differ."""
    if np.ptp(values):
        raise ValueError(
            f"{path} is several numbers, {np.min(values):.6g} to {np.max(values):.6g}: {path}.scale"
        )
    return float(np.max(values))


def typical_size(rotor: Rotor, path: str) -> float:
    """A size of a parameter for steps of differences, above 0, in its unit.

    The number itself; for a zero the largest of its kind there (of kxy: of the support's stiffness), or 1;
    1 for a scale, 1 degree for an angle.

    Raises
    ------
    ValueError
        For a path that the rotor does not have.
    """
    numbers, suffix = _parameter(rotor, path)
    if suffix == "scale" or not numbers:
        return 1.0
    alike = [_numbers(rotor)[kind, i][other] for kind, i, key in numbers for other in _alike((key,))]
    size, around_it = (np.abs(np.hstack(each)).max() for each in ([*numbers.values()], alike))
    return float(size or around_it or 1.0)


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
    match = re.fullmatch(r"probe\[(.+)\](\.angle|\.gain)", path)
    if probes and match:
        name, rest = match.groups()
        one_of(name, f"{path}: the probe", ("*", *probes))
        return tuple(f"probe[{probe}]{rest}" for probe in probes if name in ("*", probe))
    numbers, _ = _parameter(rotor, path)
    kind, star, rest = path.partition("[*]")
    if not star:
        return (path,)
    places = [i for each, i in _numbers(rotor) if each == kind]
    chosen = dict.fromkeys(places.index(i) + 1 for _, i, _ in numbers)
    return tuple(f"{kind}[{n}]{rest}" for n in chosen)


def _parameter(rotor: Rotor, path: str) -> tuple[dict[tuple[str, int, str], Any], str]:
    """The numbers that a path is of, by kind, place and key, as they stand, and its suffix."""
    if is_reading(path):
        return {}, "scale" if path.endswith("gain") else "offset"
    match = re.fullmatch(r"([^.\[\]]+)(?:\[(.*)\])?\.([^.\[\]]+)(?:\.([^\[\]]+))?", path)
    if match is None:
        raise ValueError(f"{path!r} is no parameter: one looks like bearing[1].kxx or material.density.scale")
    kind, selection, name, suffix = match.groups(default="")
    of_kind = _NAMES[one_of(kind, f"{path}: the kind", (*_NAMES, *_READINGS))]
    keys = _GROUPS.get(one_of(name, f"{path}: of a {kind},", of_kind), (name,))
    if suffix:
        one_of(suffix, f"{path}: the suffix", tuple(_ACTS)[1:] if keys[0] in _TABLED else ("scale",))
    if suffix == "scale" and len(keys) > 1:
        keys = _alike(keys)
    numbers = _numbers(rotor)
    places = [i for each, i in numbers if each == kind]
    if selection not in ("", "*"):
        items = {"material": [rotor], "disc": rotor.discs}.get(kind, rotor.supports)
        called = [getattr(items[i], "name", "") for i in places]
        numbered = {str(n): i for n, i in enumerate(places, start=1)}
        named = {name: i for name, i in zip(called, places, strict=True) if name and called.count(name) == 1}
        places_of = numbered | named | numbered
        parts = map(str.strip, selection.split(","))
        places = [places_of[one_of(part, f"{path}: the {kind}", tuple(places_of))] for part in parts]
    chosen = {
        (kind, i, key): numbers[kind, i][key] for i in places for key in keys if key in numbers[kind, i]
    }
    if not chosen:
        raise ValueError(f"{path}: the rotor has no {kind} with this number")
    return chosen, "scale" if name == "scale" else suffix


def _alike(keys: tuple[str, ...]) -> tuple[str, ...]:
    """All entries of the stiffness or damping that a key is of, or the keys as they are."""
    return tuple(key for key in _TABLED if key[0] == keys[0][0]) or keys


def _numbers(rotor: Rotor) -> _Numbers:
    """To be read only: they are kept with the rotor."""
    kept: _Numbers | None = vars(rotor).get("_numbers")
    if kept:
        return kept
    numbers = {("material", 0): {key: getattr(rotor, key) for key in _MATERIAL}}
    for i, disc in enumerate(rotor.discs):
        numbers["disc", i] = {key: getattr(disc, key) for key in _DISC}
    for i, support in enumerate(rotor.supports):
        values = [*support.table.transpose(0, 2, 3, 1).reshape(8, -1), support.tilting_stiffness]
        if stand := support.pedestal:
            values += [stand.mass, *stand.xy("stiffness"), *stand.xy("damping")]
        numbers[support.kind, i] = dict(zip(_SUPPORT, values, strict=False))
    vars(rotor)["_numbers"] = numbers
    return numbers


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
    paths, middle = rotor.calibration.names, evaluate(rotor)
    variance = np.zeros(middle.shape)
    for column in np.sqrt(3.0) * rotor.calibration.columns().T:
        up, down = (
            evaluate(with_changes(rotor, dict(zip(paths, step, strict=True)))) for step in (column, -column)
        )
        if not up.shape == down.shape == middle.shape:
            raise ValueError("their number changes")
        variance += np.abs(up - down) ** 2 / 12 + np.abs(up + down - 2 * middle) ** 2 / 18
    return np.sqrt(variance)


def band(
    rotor: Rotor, what: str, evaluate: Callable[[Rotor], AnyArray]
) -> tuple[FloatArray | None, tuple[str, ...]]:
    """`spread`, or None without a calibration and where it cannot be given, and a warning.

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
    if rotor.calibration.needs_trial_run:
        return std, ("the readings of the calibration contradict the model: its errors exceed the bands",)
    return std, ()


def nearest_modes(middle: FloatArray, other: FloatArray) -> FloatArray:
    """Frequencies of modes over speed, shape (S, n), in the order of those that they are nearest to.

    Two modes that exchange their numbers with the parameters keep them so.
    """
    from scipy.optimize import linear_sum_assignment

    apart = np.nan_to_num(middle[:, :, None] - other[:, None, :]) ** 2
    return other[:, linear_sum_assignment(apart.sum(axis=0))[1]]
