"""What is left to do after a check run: nothing, a trim, or to take off what is mounted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from balancing.coefficients.baseline import match_speeds
from balancing.correction.correction_result import Correction
from balancing.data.result_columns import rms, small, three_figures, weight_rows
from balancing.data.trials import Trials
from balancing.mounting.mount_result import Mounted
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import ComplexArray
from rotorid.base.json import plain
from rotorid.base.result import Column, text
from rotorid.base.text import capital, figures, listing

WORTH = 0.9
"""Of the vibration in the check run: what a trim has to stay below."""


@dataclass(frozen=True, eq=False)
class LeftToDo(Answered):
    """A decision after the last check run.

    Attributes
    ----------
    word, why
        What to do, and a clause.
    correction
        Total weights with the check run counted.
    run, planes, there
        The check run, planes, and what is mounted in it, (P,).
    trim
        What to add now, (P,); zero but for a trim.
    pieces
        The trim as pieces in holes; None: at any angle.
    """

    word: Literal["done", "trim", "take off what is mounted", "add nothing yet"]
    why: str
    correction: Correction
    run: str
    planes: tuple[str, ...]
    there: ComplexArray
    trim: ComplexArray
    pieces: Mounted | None = None

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's units."""
        return plain(
            {
                "word": self.word,
                "why": self.why,
                "run": self.run,
                "mounted": weight_rows(self.correction.labels, self.planes, self.there),
                "add": self.correction.work_rows(self.planes, self.trim),
                "holes": [] if self.pieces is None else self.pieces.to_dict()["holes"],
            }
        )

    @property
    def answer(self) -> Answer:
        """What to do; what is mounted, and the trim."""
        c, scale, unit = (
            self.correction,
            self.correction.labels.weight_scale,
            self.correction.labels.weight_in,
        )
        mounted = [c.labels.weight_at(w) if w else "nothing" for w in self.there]
        trim = [
            f"{'take away' if plane in c.remove else 'add'} {figures(abs(w) * scale)} {unit} at {at:.1f}°"
            if w
            else "nothing"
            for plane, w, at in zip(self.planes, self.trim, c.places(self.planes, self.trim), strict=True)
        ]
        columns = [Column("plane", self.planes, str), Column("mounted", mounted, str)]
        what = capital(self.word)
        if self.word == "trim":
            columns.append(Column("trim, beside that", trim, str))
            pairs = zip(self.planes, trim, self.trim, strict=True)
            each = [f"{words} in plane {plane!r}" for plane, words, w in pairs if w]
            what += f": {listing(each, 'and') if self.pieces is None else self.pieces.in_holes()}"
        return Answer(f"{what}; {self.why}.", text(columns, width=COLUMNS))


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
    c, unit, scale = correction, correction.labels.vibration_in, correction.labels.vibration_scale
    run, planes, there = c.mounted or (check.runs[-1], c.planes, np.zeros(len(c.planes), dtype=complex))
    nothing = np.zeros_like(there)
    pick = np.ix_(match_speeds(check.speeds, c.speeds), [c.sensors.index(name) for name in check.sensors])
    now, before = rms(check.mean[-1]), rms(c.before[pick])
    after = c.after[pick] if pieces is None else pieces.after[pick]
    sure = None if pieces is not None else c.check_rms
    left = rms(after) if sure is None or judged == "fail" else sure
    change = f"rms {three_figures(now * scale)} → {small(rms(after) * scale, now * scale)} {unit}".rstrip()
    change += "" if sure is None else f", below {figures(sure * scale, 2)} in 95 of 100 check runs"
    if judged == "pass":
        return LeftToDo("done", "every limit is kept", c, run, planes, there, nothing)
    if now >= before and explained is not True and there.any():
        why = f"the bare rotor had rms {three_figures(before * scale)} {unit}".rstrip()
        why += f"; {stop or 'check what was mounted, and where'}"
        return LeftToDo("take off what is mounted", why, c, run, planes, there, nothing)
    if stop or not (c.sound or pieces is not None):
        return LeftToDo("add nothing yet", stop or c.decision.cause, c, run, planes, there, nothing)
    trim = c.to_add if pieces is None else _in_planes(pieces, planes)
    if trim is None or not trim.any() or left >= WORTH * now:
        added = "a trim" if pieces is None else "pieces beside these"
        why = f"{added} would not make it clearly better ({change})"
        open_ = judged == "fail" or explained is False
        return LeftToDo("add nothing yet" if open_ else "done", why, c, run, planes, there, nothing)
    return LeftToDo("trim", change, c, run, planes, there, trim, pieces)


def _in_planes(pieces: Mounted, planes: tuple[str, ...]) -> ComplexArray:
    """Weights of pieces, (P,), in these planes."""
    chosen = dict(zip(pieces.correction.planes, pieces.weights, strict=True))
    return np.array([chosen.get(plane, 0.0) for plane in planes], dtype=complex)
