"""What is left to do after a check run: nothing, a trim, or to take off what is mounted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from balancing.coefficients.baseline import match_speeds
from balancing.coefficients.repeatability import tail
from balancing.correction.correction_result import Correction
from balancing.data.result_columns import rms, small, three_figures, weight_rows
from balancing.data.trials import Trials
from balancing.mounting.mount_result import Mounted
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import ComplexArray
from rotorid.base.json import plain
from rotorid.base.result import Column, text
from rotorid.base.text import figures, listing

Word = Literal["done", "trim", "take off", "add nothing yet"]
WORTH = 0.9
"""Of the vibration in the check run: what a trim has to stay below."""

UNCLEAR = 0.05
"""Probability that errors alone make such a trim, from which on it is not one."""


@dataclass(frozen=True, eq=False)
class LeftToDo(Answered):
    """A decision after the last check run.

    Attributes
    ----------
    word, why
        What to do, and a clause.
    correction
        Total weights with the check run counted.
    run, planes, there, add
        The check run, planes, what is mounted in it and the trim, both (P,).
    now
        Root mean square of the check run.
    pieces
        The trim as pieces in holes; None: at any angle.
    """

    word: Word
    why: str
    correction: Correction
    run: str
    planes: tuple[str, ...]
    there: ComplexArray
    add: ComplexArray
    now: float
    pieces: Mounted | None = None

    @property
    def trim(self) -> ComplexArray:
        """What to add now, (P,); zero but for a trim."""
        if self.word != "trim":
            return np.zeros_like(self.add)
        if self.pieces is None:
            return self.add
        chosen = dict(zip(self.pieces.correction.planes, self.pieces.weights, strict=True))
        return np.array([chosen.get(plane, 0.0) for plane in self.planes])

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's units."""
        c, labels, add = self.correction, self.correction.labels, self.trim
        moves = weight_rows(labels, self.planes, add)
        for row, at in zip(moves, c.places(self.planes, add).tolist(), strict=True):
            row.update(action="remove" if row["plane"] in c.remove else "add", place_deg=at)
        return plain(
            {
                "word": self.word,
                "why": self.why,
                "run": self.run,
                "rms_now": self.now * labels.vibration_scale,
                "mounted": weight_rows(labels, self.planes, self.there),
                "add": moves,
                "holes": [] if self.pieces is None else self.pieces.to_dict()["holes"],
            }
        )

    @property
    def answer(self) -> Answer:
        """What to do; what is mounted, and the trim."""
        labels = self.correction.labels
        cells = [
            [labels.weight_at(w) if w else "nothing" for w in weights] for weights in (self.there, self.trim)
        ]
        columns = [Column("plane", self.planes, str), Column("mounted", cells[0], str)]
        if self.word == "trim":
            columns += [Column("trim, beside that", self._moves("nothing"), str), *self._widths()]
        judged = {
            "done": f"Done, nothing to add: {self.why}.",
            "trim": f"Trim: {listing(filter(None, self._moves('')), 'and')}; {self.why}.",
            "take off": f"Take off what is mounted: {self.why}.",
            "add nothing yet": f"Add nothing yet: {self.why}.",
        }[self.word]
        return Answer(judged, text(columns, width=COLUMNS))

    def _widths(self) -> list[Column]:
        """95 % of a trim at any angle: what is mounted is known."""
        c = self.correction
        if self.pieces is not None or c.covariance is None:
            return []
        reach = dict(zip(c.planes, c.half_widths()[0] * c.labels.weight_scale, strict=True))
        widths = [figures(reach.get(plane, 0.0), 2) for plane in self.planes]
        return [Column("95 %", [f"± {width} {c.labels.weight_in}" for width in widths], str)]

    def _moves(self, nothing: str) -> list[str]:
        """What to do in each plane."""
        c, words = self.correction, []
        if self.pieces is not None:
            held = self.pieces.in_holes()
            verb = "take away" if set(self.planes) <= set(c.remove) else "add"
            return [f"{verb} {held}"] if not nothing else [self.pieces.in_holes(p) for p in self.planes]
        places = c.places(self.planes, self.add)
        for plane, there, add, at in zip(self.planes, self.there, self.add, places, strict=True):
            size = f"{figures(abs(add) * c.labels.weight_scale)} {c.labels.weight_in}"
            verb = "take away" if plane in c.remove else "add"
            in_plane = "" if nothing else f" in plane {plane!r}"
            if there and abs(there + add) <= 1e-9 * abs(there):
                words.append(f"take off {c.labels.weight_at(there)}{in_plane}")
            else:
                words.append(f"{verb} {size} at {at:.1f}°{in_plane}" if add else nothing)
        return words


def left_to_do(
    correction: Correction,
    check: Trials,
    *,
    explained: bool | None = None,
    judged: str = "",
    stop: str = "",
    pieces: Mounted | None = None,
) -> LeftToDo:
    """Decide what is left to do after the last check run.

    Parameters
    ----------
    correction
        Total weights, the check run counted; what is mounted in it is `correction.mounted`.
    check
        The check runs.
    explained
        Whether the check run did what was predicted; None: not known.
    judged
        What limits say of it: "pass", "fail", "not decidable"; empty: there are none.
    stop
        Why nothing may be added before something else is done; empty: nothing speaks against it.
    pieces
        The trim as pieces beside what is mounted, where it is to be one of pieces.
    """
    c, labels = correction, correction.labels
    zeros = np.zeros(len(c.planes), dtype=complex)
    run, planes, there = c.mounted or (check.runs[-1], c.planes, zeros)
    add = c.weights if c.to_add is None else c.to_add
    pick = np.ix_(match_speeds(check.speeds, c.speeds), [c.sensors.index(name) for name in check.sensors])
    now, before = rms(check.mean[-1]), rms(c.before[pick])
    after = c.after[pick] if pieces is None else pieces.after[pick]
    sure = None if pieces is not None else c.check_rms
    left = rms(after) if sure is None or judged == "fail" else sure
    unit, scale = labels.vibration_in, labels.vibration_scale
    words = f"rms {three_figures(now * scale)} → {small(rms(after) * scale, now * scale)} {unit}".rstrip()
    words += "" if sure is None else f", below {figures(sure * scale, 2)} in 95 of 100 check runs"
    word: Word = "trim"
    if judged == "pass":
        word, words = "done", "every limit is kept"
    elif now >= before and explained is not True and there.any():
        word = "take off"
        words = f"it leaves rms {three_figures(now * scale)}, the bare rotor {three_figures(before * scale)}"
        words = f"{words} {unit}".rstrip() + "; check what was mounted, and where"
    elif stop or not (c.sound or pieces is not None):
        word, words = "add nothing yet", stop or c.decision.cause
    elif (pieces is not None and not pieces.weights.any()) or not left < WORTH * now:
        kind = "no pieces beside these make" if pieces is not None else "a trim does not make"
        word = "add nothing yet" if judged == "fail" or explained is False else "done"
        words = f"{kind} it clearly better ({words})"
    elif pieces is None and _within_errors(c, tuple(planes), add):
        word = "add nothing yet" if judged == "fail" or explained is False else "done"
        words = f"a trim lies within its errors ({words})"
    return LeftToDo(word, words, c, run, tuple(planes), there, add, now, pieces)


def _within_errors(c: Correction, planes: tuple[str, ...], add: ComplexArray) -> bool:
    """Whether errors alone make such a trim of all planes together in 5 of 100 jobs or more."""
    if c.covariance is None or not c.covariance.any():
        return False
    trim = dict(zip(planes, add, strict=True))
    vector = np.array([part for p in c.planes for part in (trim[p].real, trim[p].imag)])
    chi_square = float(vector @ np.linalg.pinv(c.covariance, rcond=1e-10) @ vector)
    return bool(tail(chi_square, len(vector), c.dof) >= UNCLEAR)
