"""What all results of `fem` have in common: tables, one sentence, and how they are shown."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar, dataclass_transform

import numpy as np

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import read_only
from rotorid.base.tables import Table, frame, html, terminal

if TYPE_CHECKING:
    import pandas as pd

NORMAL_95 = 1.959964  # standard deviations on each side that hold 95 % of a normal distribution


T = TypeVar("T")


@dataclass_transform(eq_default=False, frozen_default=True)
def holding_arrays(cls: type[T]) -> type[T]:
    """A frozen dataclass that equals itself only, as arrays have no one answer to `==`."""
    return dataclass(frozen=True, eq=False, repr=False)(cls)


class Result(Answered):
    """A result with tables and one sentence; nobody may write into its arrays."""

    def __post_init__(self) -> None:
        read_only(*(value for value in vars(self).values() if isinstance(value, np.ndarray)))

    @abstractmethod
    def tables(self) -> tuple[Table, ...]:
        """The numbers of the result, as tables."""

    def to_frame(self) -> pd.DataFrame:
        """The last of the tables: of modes, a row per node."""
        return frame(self.tables()[-1].columns)

    @abstractmethod
    def sentence(self) -> str:
        """The answer in one sentence."""

    @property
    def answer(self) -> Answer:
        """The sentence, the first table and the warnings; the other tables behind them."""
        first, *others = self.tables()
        notes = tuple(filter(None, [getattr(self, "cut", "")]))
        return Answer(
            self.sentence(),
            terminal(first),
            getattr(self, "warnings", ()),
            notes,
            tuple(map(terminal, others)),
            ", ".join(table.name for table in others),
        )

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.sentence()})"

    def _repr_html_(self) -> str:
        return "\n".join(map(html, self.tables()))
