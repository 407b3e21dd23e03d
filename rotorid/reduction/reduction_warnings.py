"""Warnings of a reduction: masses, frequencies and shapes that should not be trusted."""

from __future__ import annotations

import numpy as np

import fem
from fem.assembly import ignored_inertia
from rotorid.base.arrays import FloatArray
from rotorid.reduction.equivalent.small_model_modes import mac
from rotorid.regression.estimate import Estimate

SENSITIVE = 0.1
"""A report warns where input errors of 1 % move a mass by more than this share."""

HEAVY = 1.05
"""Masses that weigh more than this times the rotor are said."""

ALIKE = 0.9
"""Below this MAC two shapes are not those of one mode."""

OFF = 0.1
"""A frequency of the model that is off by more is said."""

APART = 0.05
"""A measured frequency that differs by more from the rotor's is said."""


def of_shaft(rotor: fem.Rotor, full: fem.Modes) -> list[str]:
    """Warnings of the modes, without those on what the plane at rest leaves out of a rotor that has it."""
    ours = ignored_inertia(full.rotor)
    return [*ignored_inertia(rotor), *(text for text in full.warnings if text not in ours)]


def other_frequencies(measured: FloatArray, computed: FloatArray) -> list[str]:
    """What to say where the measured rotor is not the one of the model."""
    out = []
    for k, (f, g) in enumerate(zip(measured, computed, strict=False), start=1):
        if abs(f / g - 1) > APART:
            out.append(
                f"the measured frequency {k}, {f:.6g} rad/s, differs by {100 * (f / g - 1):+.1f} % from "
                f"that of the rotor model, {g:.6g} rad/s: its compliance may not be the measured rotor's"
            )
    return out


def other_shapes(measured: FloatArray, computed: FloatArray, places: tuple[int, ...]) -> list[str]:
    """What to say of measured shapes that are not those of the rotor's modes of the same number."""
    found = mac(measured, computed)
    out = []
    for k, row in enumerate(found[:, : found.shape[0]], start=1):
        if k > found.shape[1] or row[k - 1] >= ALIKE:
            continue
        best = int(np.argmax(found[k - 1])) + 1
        text = f"the shape of measured mode {k} is not that of the rotor's mode {k} (MAC {row[k - 1]:.2f})"
        if found[k - 1, best - 1] >= ALIKE:
            out.append(
                f"{text} but of its mode {best} (MAC {found[k - 1, best - 1]:.2f}): is a mode missing?"
            )
            continue
        flips = 1.0 - 2.0 * np.eye(len(measured))
        turned = mac(flips * measured[:, k - 1 : k], computed[:, k - 1 : k])[:, 0]
        at = int(np.argmax(turned))
        hint = f": is its sign at node {places[at]} right?" if turned[at] >= ALIKE else ""
        out.append(text + hint)
    return out


def of_regression(
    estimate: Estimate,
    sensitivity: FloatArray,
    omega: FloatArray,
    places: tuple[int | str, ...],
    agreement: FloatArray,
) -> list[str]:
    """Masses that are not positive, modes of other shape, and a regression that is ill-conditioned."""
    out = [
        f"the mass at node {p} is {m:.4g} kg, not positive: no physical model; use other nodes or more modes"
        for p, m in zip(places, estimate.solution, strict=True)
        if m <= 0
    ]
    if np.isnan(omega).any():
        out.append("with these masses the model has modes that do not vibrate")
    out += [
        f"mode {k} of the model does not have the shape of the rotor's (MAC {value:.2f}, below {ALIKE}): "
        "do not rely on its frequency; use other nodes or more masses"
        for k, value in enumerate(agreement, start=1)
        if not value >= ALIKE
    ]
    if (sensitivity > SENSITIVE / 0.01).any():
        moves = ", ".join(f"{x:.0f} %" for x in sensitivity)
        out.append(
            f"the regression is ill-conditioned (condition number "
            f"{estimate.condition_number:.1f}): errors of "
            f"1 % in the compliances and shapes move the masses by {moves}; more modes make them firmer"
        )
    return out


def far_off(errors: FloatArray) -> list[str]:
    """Frequencies of the small model that are far from the rotor's."""
    far = [(k, e) for k, e in enumerate(errors, start=1) if abs(e) > OFF]
    if not far:
        return []
    which = ", ".join(f"mode {k} by {100 * e:+.1f} %" for k, e in far)
    return [
        f"frequencies of the model are far off: {which}; use it below them, or more masses or other nodes"
    ]


def too_heavy(rotor: fem.Rotor, masses: FloatArray) -> list[str]:
    """Equivalent masses that weigh more than the rotor they stand for."""
    together = float(masses.sum())
    if together <= HEAVY * rotor.total_mass:
        return []
    return [
        f"the masses weigh {together:.4g} kg together, more than the rotor ({rotor.total_mass:.4g} kg): they "
        "stand where it hardly moves; use other nodes"
    ]
