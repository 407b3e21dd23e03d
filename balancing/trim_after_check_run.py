"""What is left to do after a check run: nothing, a trim, or to take off what is mounted.

Done is a rotor whose readings keep their limits with 95 %, or, without limits, one whose trim is within its
own error: the 95 % region of the weights that it asks for, the check run counted, holds those that are
mounted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from balancing.choice_of_pieces import Mounted
from balancing.correction_result import Correction
from balancing.influence import in_order, match_readings
from balancing.printed_readings import reading_columns, rms, vector_columns, weight_rows
from balancing.trials import Trials
from balancing.weights_and_prediction import rms_change, shown
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, records, text
from rotorid.base.text import capital, figures

if TYPE_CHECKING:
    import pandas as pd

WORTH = 0.9
"""Of the vibration in the check run: what a trim has to stay below."""

Word = Literal["done", "trim", "take off what is mounted", "add nothing yet"]


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
    check
        The check runs.
    before, after, within
        Vibration of the bare rotor and with the trim at the readings of the check, (S, C), and the radius of
        95 % of check runs, in the job's unit; NaN where errors are unknown.
    pieces
        The trim as pieces in holes; None: at any angle.
    """

    word: Word
    why: str
    correction: Correction
    run: str
    planes: tuple[str, ...]
    there: ComplexArray
    trim: ComplexArray
    check: Trials
    before: ComplexArray
    after: ComplexArray
    within: FloatArray
    pieces: Mounted | None = None

    @property
    def now(self) -> float:
        """Root mean square of the last check run."""
        return rms(self.check.mean[-1])

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's units; readings as they were read, and predicted with the trim."""
        labels, check = self.correction.labels, self.check
        readings = (
            *reading_columns(labels, check.speeds, check.sensors),
            *vector_columns(labels, "achieved", check.mean[-1]),
            *vector_columns(labels, "after", self.after),
            Column("within", self.within.ravel()),
        )
        return plain(
            {
                "word": self.word,
                "why": self.why,
                "run": self.run,
                "mounted": weight_rows(labels, self.planes, self.there),
                "add": self.correction.work_rows(self.planes, self.trim),
                "holes": [] if self.pieces is None else self.pieces.to_dict()["holes"],
                "readings": records(readings) if self.word == "trim" else [],
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """The trim, its pieces or a row a plane; nothing to add is 0."""
        weights = self.correction.work_columns(self.planes, self.trim)
        return frame(weights) if self.pieces is None else self.pieces.to_frame()

    @property
    def answer(self) -> Answer:
        """What to do; what is mounted, and the trim in each plane."""
        c = self.correction
        columns = [
            Column("plane", self.planes),
            Column("mounted", [c.labels.weight_at(w) if w else "nothing" for w in self.there]),
        ]
        lines = []
        if self.word == "trim" and self.pieces is not None:
            lines = ["", f"Trim with pieces, in {c.labels.weight_in}:"]
            lines += [f"  {line}" for line in self.pieces.in_planes()]
        elif self.word == "trim":
            add = zip(self.planes, self.trim, c.places(self.planes, self.trim), strict=True)
            cells = [
                f"{'take away' if plane in c.remove else 'add'} {c.labels.weight_words(abs(w))} at {at:.1f}°"
                if w
                else "nothing"
                for plane, w, at in add
            ]
            columns.append(Column("trim", cells))
        table = text(columns, left=len(columns), width=COLUMNS)
        return Answer(f"{capital(self.word)}; {self.why}.", "\n".join([table, *lines]), to_mount=True)


def after_check_run(
    correction: Correction,
    check: Trials,
    *,
    explained: bool | None = None,
    judged: str = "",
    stop: str = "",
    pieces: Mounted | None = None,
    bare: ComplexArray | None = None,
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
    bare
        Vibration of the bare rotor at the speeds and sensors of the check, (S, C); None: the correction's.
    """
    c, labels = correction, correction.labels
    run, planes, there = c.mounted
    pick = np.ix_(*match_readings(check, c.influence))
    bare = c.before[pick] if bare is None else bare
    now, before = rms(check.mean[-1]), rms(bare)
    made = pieces or c
    trim = c.to_add if pieces is None else in_order(pieces.weights, pieces.correction.planes, planes)
    after, bound = rms(made.after[pick]), made.check_rms if c.errors_known else None
    change = rms_change(labels, check.mean[-1], made.after[pick])
    if bound is not None:
        change += f", below {figures(bound * labels.vibration_scale, 2)} in ≥ 95 of 100 check runs"
        change += ", and it may get worse" * (judged == "fail" and bound > now)
    left = after if bound is None or judged == "fail" else bound
    worth = trim.any() and left < WORTH * now
    again = c.decision.cause if c.decision.word == "measure again" else ""
    blocked = stop or "; ".join(c.contradictions) or again
    settled = not blocked and judged != "fail" and explained is not False
    word: Word = "add nothing yet"
    why = (
        f"{'a trim' if pieces is None else 'pieces beside these'} would not make it clearly better ({change})"
    )
    if judged == "pass":
        word, why = "done", "every limit is kept"
    elif now >= before and explained is not True and there.any():
        word = "take off what is mounted"
        why = f"the bare rotor had rms {shown(labels, before)}; "
        why += stop or "check what was mounted, and where"
    elif settled and c.region_known and c.region().holds(in_order(there, planes, c.planes)):
        word = "done"
        why = f"a trim would be within its own error ({change})"
        why += f", and may be worth it: {', '.join(c.work_words(planes, trim))}" if worth else ""
    elif settled and not worth:
        word = "done"
    elif blocked or (worth and c.decision.word == "do not mount" and pieces is None):
        why = blocked or c.decision.cause
    elif worth:
        word, why = "trim", change
    return LeftToDo(
        word,
        why,
        c,
        run,
        planes,
        there,
        trim if word == "trim" else 0 * trim,
        check,
        bare,
        made.after[pick],
        c.within[pick],
        pieces if word == "trim" else None,
    )
