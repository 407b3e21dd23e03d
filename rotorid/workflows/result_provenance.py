"""Results of the library beside each other, as a workflow gives them."""

from __future__ import annotations

import dataclasses
from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import Answer, together
from rotorid.commands.outcome import Delivered

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.report.equations import Equations


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Parts(Delivered):
    """Results of the library beside each other."""

    @property
    @abstractmethod
    def parts(self) -> Mapping[str, Any]:
        """Results by their keys in the document, where "" is its top; None: not asked for."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        known = {key: part.to_dict() for key, part in self.parts.items() if part is not None}
        return {**known.pop("", {}), **known}

    @property
    def equations(self) -> Equations:
        """Those of the first."""
        from rotorid.report.equations_of_results import equations_of

        return equations_of(next(iter(self.parts.values())))

    @property
    def answer(self) -> Answer:
        """Those of the parts, one after the other."""
        return together(part.answer for part in self.parts.values() if part is not None)

    def to_frame(self) -> pd.DataFrame:
        """The table of the first."""
        frame: pd.DataFrame = next(iter(self.parts.values())).to_frame()
        return frame


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Found(Parts):
    """One result of the library as it is; subclasses say which."""

    found: Any

    @property
    def parts(self) -> Mapping[str, Any]:
        """That one."""
        return {"": self.found}

    def figure(self) -> Figure:
        """Its picture."""
        from rotorid.base.plot_style import on_figure
        from rotorid.plots import plot

        return on_figure(lambda ax: plot(self.found, ax))
