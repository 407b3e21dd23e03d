"""Planes that measured or computed coefficients tell apart only by their errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from balancing.coefficients.identifiability import (
    HOPELESS,
    REMEDY,
    alike_words,
    large,
    refusal,
    resolution,
    separation,
)
from balancing.coefficients.influence import Influence
from rotorid.base.arrays import BoolArray, FloatArray


def check_resolution(
    influence: Influence,
    *,
    refuse: bool,
    counts: BoolArray | None = None,
    remedies: Callable[[], Sequence[str]] = tuple,
) -> tuple[str, ...]:
    """Refuse planes that the coefficients tell apart only by their errors.

    Errors that are assumed refuse nothing: the digits of the readings do, or without an end of them, for
    coefficients from runs, a condition number that no instrument supports.

    Parameters
    ----------
    influence
        Coefficients at the speeds and sensors and of the planes in question, of full rank.
    refuse
        Or warn.
    counts
        Readings, speed by speed, that count, (N,); default all.
    remedies
        What to do instead, in sentences.

    Returns
    -------
    The warning, if there is one.

    Raises
    ------
    UndeterminedError
        Naming the planes that act alike.
    """
    if len(influence.planes) < 2:
        return ()
    assumed = influence.error_source == "assumed"
    counts = np.ones(influence.W[..., 0].size, dtype=bool) if counts is None else counts
    words = _unresolved(influence, influence.digits if assumed else influence.known_covariance, counts)
    if words and refuse:
        raise refusal(words, influence.warnings, influence.contradictions, remedies())
    if not words and assumed:
        words = _unresolved(influence, influence.covariance, counts)
    return (words,) if words else ()


def _unresolved(influence: Influence, covariance: FloatArray | None, counts: BoolArray) -> str:
    """Which planes act alike within the errors of a covariance of (Y₀, W); empty where none do."""
    P = len(influence.planes)
    W = influence.W.reshape(-1, P)[counts]
    if covariance is not None and covariance[..., 2:, 2:].any():
        found = resolution(W, covariance[..., 2:, 2:].reshape(-1, 2 * P, 2 * P)[counts])
        if found.significant(influence.dof):
            return ""
        within = f" within the errors of the readings (told apart by {found.ratio:.2g} times the errors)"
        return alike_words(W, large(found.direction), influence.planes) + within + REMEDY
    told = separation(W)
    if covariance is not None or influence.last_run is None or told.condition_number <= HOPELESS:
        return ""
    within = f": no instrument supports a condition number of {told.condition_number:.2g}"
    return alike_words(W, large(told.weakest), influence.planes) + within + REMEDY
