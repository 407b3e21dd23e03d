"""Names of the old modules until this one is written; and the base of results that it will have."""

from fem.critical import (
    NOT_COUNTED,
    critical_speeds,
    critical_speeds_below,
    critical_speeds_near,
    lowest_critical_speeds,
)
from fem.matrices.undamped_matrices import NO_MASS, Pencil, one_plane, whole_rotor
from fem.mesh import MeshCheck, mesh_check
from fem.modes_result import Modes
from fem.solvers.eigen import (
    DENSE,
    Spectrum,
    factor,
    fine_mesh_warning,
    finite_modes,
    lowest_modes,
    rigid_scale,
)
from rotorid.base.answer import Answer, Answered
from rotorid.base.tables import Table, html, terminal


class Result(Answered):
    """A result with tables and one sentence."""

    def tables(self) -> tuple[Table, ...]:
        """The numbers."""
        raise NotImplementedError

    def sentence(self) -> str:
        """The answer."""
        raise NotImplementedError

    @property
    def answer(self) -> Answer:
        """The sentence and the first table."""
        return Answer(self.sentence(), terminal(self.tables()[0]))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.sentence()})"

    def _repr_html_(self) -> str:
        return "\n".join(map(html, self.tables()))


__all__ = [
    "DENSE",
    "NOT_COUNTED",
    "NO_MASS",
    "MeshCheck",
    "Modes",
    "Pencil",
    "Result",
    "Spectrum",
    "critical_speeds",
    "critical_speeds_below",
    "critical_speeds_near",
    "factor",
    "fine_mesh_warning",
    "finite_modes",
    "lowest_critical_speeds",
    "lowest_modes",
    "mesh_check",
    "one_plane",
    "rigid_scale",
    "whole_rotor",
]
