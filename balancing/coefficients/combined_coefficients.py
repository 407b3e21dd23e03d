"""Measured and computed influence coefficients together, each counting by how well it is known.

Of one reading let z hold all that is known, stacked: the measured (Y₀, W) and the computed W, with the
covariance C (block diagonal: the model and the measurement know nothing of each other). Where both speak
of the same plane they must agree: A z = 0 for the differences A z. The best linear estimate that obeys it is

    ẑ = M z,   M = 1 − C Aᵀ (A C Aᵀ)⁻¹ A,   with the covariance   M C Mᵀ

(least (ẑ − z)ᵀ C⁻¹ (ẑ − z), Lagrange). For a single number it is the mean weighted by 1/variance, both
directions of a reading as their mean. What is measured together with a coefficient profits too: the reading
of the bare rotor, and planes that only one side has, through their correlation. M also acts on what the
channels of the measurement have in common, and on what errors of the model's parameters do to all of them; it
is chosen for each channel alone.

Whether both agree within their errors: d = W_measured − W_computed of one plane and reading has the
covariance S = C_measured + C_computed, and χ² = dᵀ S⁻¹ d has two degrees of freedom.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from balancing.coefficients.baseline import SPEED_TOLERANCE
from balancing.coefficients.influence import Influence
from balancing.coefficients.repeatability import tail
from balancing.data.reading_errors import hermitian, symmetric
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.base.rpm import rpm_text
from rotorid.regression import stretch

LEVEL = 0.99
"""Of the test whether both agree, for all coefficients together."""

_NAMED = 3


def combine(measured: Influence, computed: Influence) -> Influence:
    """Combine measured coefficients with those of a model, weighted by their errors.

    Parameters
    ----------
    measured
        Coefficients with a covariance, from `estimate_influence` with known errors, or stored ones.
    computed
        Of the same kind (per mass or per unbalance) with a covariance, from `model_influence` with a
        `relative_error`. Speeds within 0.5 % of a measured one count as that.

    Returns
    -------
    Influence
        At all speeds, sensors and planes of either; coefficients that only one of them has are taken from it.
        Errors of a reading, their source and degrees of freedom, labels and what was mounted are those of
        the measurement, and so is the baseline, corrected where its errors are correlated with those of the
        coefficients; it is None where a speed or sensor was not measured. Contradictions are warnings.

    Raises
    ------
    ValueError
        If one side has no covariance, both are not of the same kind, or a coefficient is on neither side.
    """
    for side, words in (
        (measured, "measured coefficients are not known: state the errors of a reading, or repeat readings"),
        (computed, "computed coefficients are not known: state the relative error of the model"),
    ):
        if side.covariance is None:
            raise ValueError(f"coefficients can be combined only by their errors, and those of the {words}")
    _check_kinds(measured, computed)
    speeds, ours, theirs = _speeds(measured, computed)
    sensors = tuple(dict.fromkeys((*measured.sensors, *computed.sensors)))
    planes = tuple(dict.fromkeys((*measured.planes, *computed.planes)))
    S, C, P = len(speeds), len(sensors), len(planes)
    W, Y = np.empty((S, C, P), dtype=complex), np.zeros((S, C), dtype=complex)
    covariance = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    each = [*_columns(measured), *_columns(computed)]
    columns = np.zeros((sum(map(len, each)), S, C, P + 1), dtype=complex)
    sides = np.concatenate(each[:3]), np.concatenate(each[3:])
    known, differences = np.zeros((S, C), dtype=bool), []
    for s, c in np.ndindex(S, C):
        a = _place(measured, ours[s], sensors[c])
        b = _place(computed, theirs[s], sensors[c])
        there = (*(measured.planes if a else ()), *(computed.planes if b else ()))
        lacking = next((plane for plane in planes if plane not in there), None)
        if lacking is not None:
            raise ValueError(
                f"there is neither a measured nor a computed coefficient of plane {lacking!r} at sensor "
                f"{sensors[c]!r}, {rpm_text(float(speeds[s]))}: compute it, or leave out one of them"
            )
        z, covariance[s, c], columns[:, s, c], found = _reading(measured, a, computed, b, planes, sides)
        Y[s, c], W[s, c] = z[0], z[1:]
        known[s, c] = a is not None
        differences += [(chi, p, c, s) for p, chi in found]
    mounted = measured.last_weights
    if mounted is not None:
        by_name = dict(zip(measured.planes, mounted, strict=True))
        mounted = np.array([by_name.get(p, 0.0) for p in planes], dtype=complex)
    parts = np.split(columns, np.cumsum([len(part) for part in each])[:-1])
    run, speed, parameters = map(np.concatenate, zip(parts[:3], parts[3:], strict=True))
    dropped = measured.baseline is not None and not known.all()
    lost = (
        "the measured baseline does not cover all speeds and sensors of the combined coefficients: give the "
        "readings of a baseline run",
    )
    return replace(
        measured,
        speeds=speeds,
        sensors=sensors,
        planes=planes,
        W=W,
        baseline=Y if measured.baseline is not None and not dropped else None,
        covariance=covariance,
        common=np.stack((run, speed)),
        parameters=parameters if len(parameters) else None,
        digits=None,
        warnings=measured.warnings
        + computed.warnings
        + _contradictions(differences, planes, sensors, speeds, measured.dof)
        + (lost if dropped else ()),
        last_weights=mounted,
    )


def _check_kinds(measured: Influence, computed: Influence) -> None:
    kinds = ["unbalance" if "_" in side.labels.weight_unit else "mass" for side in (measured, computed)]
    if kinds[0] != kinds[1]:
        units = measured.labels.weight_unit, computed.labels.weight_unit
        remedy = "give the radii of the planes, to compute them per mass"
        if kinds[0] == "unbalance":
            remedy = "compute them per unbalance, without radii"
        raise ValueError(
            f"the measured coefficients are per {kinds[0]} ({units[0]}) and the computed ones per {kinds[1]} "
            f"({units[1]}): {remedy}"
        )


def _speeds(
    measured: Influence, computed: Influence
) -> tuple[FloatArray, list[int | None], list[int | None]]:
    """All speeds, ascending, and where each stands on either side (None: nowhere)."""
    pairs: dict[int, int] = {}
    for j, speed in enumerate(computed.speeds):
        i = int(np.argmin(np.abs(measured.speeds - speed)))
        if abs(measured.speeds[i] - speed) <= SPEED_TOLERANCE * measured.speeds[i]:
            if i in pairs:
                two = f"{rpm_text(computed.speeds[pairs[i]])} and {rpm_text(speed)}"
                raise ValueError(
                    f"two computed speeds, {two}, fit the measured {rpm_text(measured.speeds[i])}: "
                    "leave one out"
                )
            pairs[i] = j
    rows: list[tuple[float, int | None, int | None]] = [
        (float(speed), i, pairs.get(i)) for i, speed in enumerate(measured.speeds)
    ]
    rows += [(float(speed), None, j) for j, speed in enumerate(computed.speeds) if j not in pairs.values()]
    rows.sort(key=lambda row: row[0])
    return np.array([r[0] for r in rows]), [r[1] for r in rows], [r[2] for r in rows]


def _place(side: Influence, speed: int | None, sensor: str) -> tuple[int, int] | None:
    if speed is None or sensor not in side.sensors:
        return None
    return speed, side.sensors.index(sensor)


def _reading(
    measured: Influence,
    a: tuple[int, int] | None,
    computed: Influence,
    b: tuple[int, int] | None,
    planes: tuple[str, ...],
    sides: tuple[ComplexArray, ComplexArray],
) -> tuple[ComplexArray, FloatArray, ComplexArray, list[tuple[int, float]]]:
    """(Y₀, W) of one reading (P + 1,), covariance, columns, χ² of the planes that both sides have."""
    first = measured.planes if a is not None else ()
    second = computed.planes if b is not None else ()
    n, m = 1 + len(first), len(sides[0])
    z = np.zeros(n + len(second), dtype=complex)
    covariance = np.zeros((2 * len(z), 2 * len(z)))
    columns = np.zeros((m + len(sides[1]), len(z)), dtype=complex)
    if a is not None:
        assert measured.covariance is not None
        z[0] = 0.0 if measured.baseline is None else measured.baseline[a]
        z[1:n] = measured.W[a]
        covariance[: 2 * n, : 2 * n] = measured.covariance[a]
        columns[:m, :n] = sides[0][:, *a]
    if b is not None:
        assert computed.covariance is not None
        z[n:] = computed.W[b]
        covariance[2 * n :, 2 * n :] = computed.covariance[b][2:, 2:]
        columns[m:, n:] = sides[1][:, *b, 1:]
    M, chi = np.eye(len(z), dtype=complex), []
    both = [(1 + first.index(p), n + second.index(p), planes.index(p)) for p in first if p in second]
    if both:
        A = np.zeros((len(both), len(z)))
        for k, (i, j, p) in enumerate(both):
            A[k, i], A[k, j] = 1.0, -1.0
            rows = stretch(A[k : k + 1])
            d = rows @ stretch(z)
            chi.append((p, float(d @ _inverse(rows @ covariance @ rows.T) @ d)))
        H = hermitian(covariance[None])[0]
        M -= H @ A.T @ _inverse(A @ H @ A.T) @ A
    M = M[[0, *(1 + first.index(p) if p in first else n + second.index(p) for p in planes)]]
    return M @ z, symmetric(stretch(M) @ covariance @ stretch(M).T), columns @ M.T, chi


def _columns(side: Influence) -> tuple[ComplexArray, ...]:
    """What is common to the run, at a speed, and to errors of parameters, each (M, S, C, P + 1)."""
    nothing = np.zeros((0, *side.W.shape[:2], side.W.shape[2] + 1), dtype=complex)
    common = (nothing, nothing) if side.common is None else side.common
    return *common, nothing if side.parameters is None else side.parameters


def _inverse(S: AnyArray) -> AnyArray:
    """Inverse of a covariance of differences; zero where nothing has an error."""
    root = np.sqrt(np.diag(S).real)
    scale = np.outer(*(np.where(root > 0, root, 1.0),) * 2)
    return np.asarray(np.linalg.pinv(S / scale, rcond=1e-12, hermitian=True) / scale)


def _contradictions(
    differences: list[tuple[float, int, int, int]],
    planes: tuple[str, ...],
    sensors: tuple[str, ...],
    speeds: FloatArray,
    dof: float | None,
) -> tuple[str, ...]:
    found = [d for d in differences if len(differences) * tail(d[0], 2, dof) < 1 - LEVEL]
    found.sort(key=lambda d: -d[0])
    words = [
        f"measured and computed coefficient of plane {planes[p]!r} at sensor {sensors[c]!r}, "
        f"{rpm_text(speeds[s])}, differ by {np.sqrt(chi / 2):.2g} times their errors"
        for chi, p, c, s in found[:_NAMED]
    ]
    if len(found) > _NAMED:
        words[-1] += f"; so do {len(found) - _NAMED} more of {len(differences)}"
    if words:
        words[-1] += ": the model, the trial runs or the stated errors are wrong"
    return tuple(words)
