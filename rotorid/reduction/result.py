"""Result of a reduction: the reduced rotor beside the rotor itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

import fem
from rotorid.base.answer import Answer, Answered, together
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, text
from rotorid.base.rpm import RPM
from rotorid.base.text import counted, error_figures, percent
from rotorid.reduction.equivalent.changed_inputs import Shift
from rotorid.reduction.equivalent.equivalent_masses_formula_50 import Normalisation, RowWeights
from rotorid.reduction.equivalent.mass_uncertainty import InputErrors, MassUncertainty, mass_uncertainty
from rotorid.reduction.equivalent.small_model_modes import mac
from rotorid.reduction.equivalent.support_flexibility_formula_47 import Separated
from rotorid.regression.estimate import Estimate

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.reduction.dynamics.small_rotor import SmallRotor

_RESIDUAL = "± is one standard deviation from the regression's residuals (model error, not measurement)"


@dataclass(frozen=True, eq=False)
class Choices:
    """How a regression was done.

    Attributes
    ----------
    source
        Whether the modes were computed from the rotor or measured.
    normalise, rows, nonnegative
        As in `equivalent_masses`.
    """

    source: Literal["rotor", "measured"]
    normalise: Normalisation
    rows: RowWeights
    nonnegative: bool

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return {
            "source": self.source,
            "normalise": self.normalise,
            "rows": self.rows if isinstance(self.rows, str) else "own",
            "nonnegative": self.nonnegative,
        }

    def words(self, modes: int) -> str:
        """Such as "the first 2 measured modes, rows relative"."""
        kind = "measured " if self.source == "measured" else ""
        text = f"the first {kind}mode" if modes == 1 else f"the first {modes} {kind}modes"
        said = [] if self.normalise == "first" else [f"shapes scaled by {self.normalise}"]
        rows = self.to_dict()["rows"]
        said += [] if rows == "equal" else [f"rows {rows}"]
        said += ["masses not negative"] if self.nonnegative else []
        return ", ".join((text, *said))


@dataclass(frozen=True, eq=False)
class Reduction(Answered):
    """An n-mass model of a rotor beside the rotor itself.

    Attributes
    ----------
    rotor
        The rotor; None where only its compliance and measured modes are known.
    nodes
        Where the masses stand: node numbers, or labels where there is no rotor.
    modes
        How many modes of the rotor the regression used.
    masses
        The `Estimate` of formula (50), kg.
    sensitivity
        Relative standard deviation of each mass per relative standard deviation of the inputs, shape (n,).
    compliance
        m/N, shape (n, n), without the seals in `seal_stiffness`.
    seal_stiffness
        Of springs from the masses to the ground beside the compliance, N/m, shape (n,).
    frequencies, shapes
        Of the n-mass model: rad/s (n,), and at the masses (n, n), scaled to fit the rotor's.
    rotor_frequencies, rotor_shapes
        Of the rotor, computed for its plane at rest or measured: rad/s (j,), and at the masses (n, j).
    rotor_modes
        The computed modes at every node, to draw; None without a rotor.
    choices
        How the regression was done: normalisation, row weights, sign of the masses, source of the modes.
    uncertainty
        What stated errors of the inputs do to masses and frequencies; None where none are stated.
    separated
        The compliance of the shaft apart from its two supports, (47); None where not asked for.
    warnings
        What a user should know before trusting the model.
    """

    rotor: fem.Rotor | None
    nodes: tuple[int | str, ...]
    modes: int
    masses: Estimate
    sensitivity: FloatArray
    compliance: FloatArray
    seal_stiffness: FloatArray
    frequencies: FloatArray
    shapes: FloatArray
    rotor_frequencies: FloatArray
    rotor_shapes: FloatArray
    rotor_modes: fem.Modes | None
    choices: Choices
    uncertainty: MassUncertainty | None
    separated: Separated | None
    warnings: tuple[str, ...]

    @property
    def positions(self) -> FloatArray | None:
        """Of the masses, m from the left end, shape (n,); None without a rotor."""
        if self.rotor is None:
            return None
        return np.asarray(self.rotor.positions[[int(node) - 1 for node in self.nodes]])

    @property
    def relative_error(self) -> FloatArray:
        """Of each frequency against the rotor's, shape (n,); NaN where the rotor's is not known."""
        return np.asarray(self.frequencies / self._padded(self.rotor_frequencies) - 1.0)

    @property
    def mac_matrix(self) -> FloatArray:
        """MAC of the model's modes (rows) with the rotor's (columns) at the masses, (n, j)."""
        return mac(self.shapes, self.rotor_shapes)

    @property
    def mac(self) -> FloatArray:
        """MAC of each mode with the rotor's mode of the same number, shape (n,); NaN where unknown."""
        return self._padded(np.diag(self.mac_matrix))

    @property
    def equations_of_motion(self) -> fem.Motion:
        """M x'' + K x = f of the small model: masses, and the inverse of the compliance.

        The displacement of the mass at node 7 is `x7`. There is no damping: what a rotor's bearings and its
        surroundings take out is for the user to add, or to estimate
        (`rotorid.identify.second_order`), or comes with the supports (`small`).
        """
        K = np.linalg.inv(self.compliance) + np.diag(self.seal_stiffness)
        n = len(self.nodes)
        names = tuple(f"x{node}" for node in self.nodes)
        return fem.Motion(np.diag(self.masses.solution), np.zeros((n, n)), (K + K.T) / 2, names, 0.0)

    def what_if(self, changes: Mapping[str, float]) -> Shift:
        """Masses and frequencies after relative changes of inputs, such as {"alpha12": 0.013}.

        Raises
        ------
        ValueError
            For an input that does not exist (they are `alpha12`, `U31`, `omega1`, `c2` …), or a change
            that is not finite.
        """
        used = self.rotor_frequencies[: self.modes], self.rotor_shapes[:, : self.modes]
        known = mass_uncertainty(
            self.compliance,
            *used,
            InputErrors(),
            seal_stiffness=self.seal_stiffness,
            normalise=self.choices.normalise,
            rows=self.choices.rows,
        )
        return known.shift(changes)

    def small(self, modal_damping: Sequence[float] = ()) -> SmallRotor:
        """The model in both planes with the rotor's supports, gyroscopic moments and damping.

        Parameters
        ----------
        modal_damping
            Damping ratios of the first modes, added to what the supports take out.

        Raises
        ------
        ValueError
            Without a rotor, or with masses that are not positive.
        """
        from rotorid.reduction.dynamics.small_rotor import small_rotor

        if self.rotor is None:
            raise ValueError(
                "measured modes and a compliance alone say nothing of bearings and the second plane: "
                "give a rotor"
            )
        return small_rotor(
            self.rotor, [int(node) for node in self.nodes], self.masses.solution, modal_damping=modal_damping
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, the keys of INTERFACE.md (`rotorid reduce`)."""
        document: dict[str, Any] = {
            "nodes": self.nodes,
            "positions_m": self.positions,
            "modes": self.modes,
            **self.choices.to_dict(),
            "masses_kg": self.masses.solution,
            "masses_std_kg": self.masses.std,
            "mass_sensitivity": self.sensitivity,
            "compliance_m_per_N": self.compliance,
            "seal_stiffness_N_per_m": self.seal_stiffness,
            "natural_frequencies_rad_s": self.frequencies,
            "rotor_frequencies_rad_s": self._padded(self.rotor_frequencies),
            "relative_error": self.relative_error,
            "mac": self.mac,
            "condition_number": self.masses.condition_number,
            "warnings": self.warnings,
        }
        if self.separated is not None:
            document["separated"] = self.separated.to_dict()
        if self.uncertainty is not None:
            document["uncertainty"] = self.uncertainty.to_dict()
        return plain(document)

    def to_frame(self) -> pd.DataFrame:
        """First a row per mass (`table` is "masses"), then a row per mode ("modes").

        Masses have node, position and mass; modes have number, frequencies, error and MAC. Cells of the other
        kind are blank.
        """
        import pandas as pd

        n = len(self.nodes)
        masses = pd.DataFrame({"node": self.nodes, "mass_kg": self.masses.solution})
        if self.positions is not None:
            masses.insert(1, "position_m", self.positions)
        modes = pd.DataFrame(
            {
                "mode": np.arange(1, n + 1),
                "frequency_rad_s": self.frequencies,
                "rotor_frequency_rad_s": self._padded(self.rotor_frequencies),
                "relative_error": self.relative_error,
                "mac": self.mac,
            }
        )
        modes.index += n
        frame = pd.concat((masses, modes), axis=1).astype({"mode": "Int64"})
        if self.rotor is not None:
            frame = frame.astype({"node": "Int64"})
        frame.insert(0, "table", ["masses"] * n + ["modes"] * n)
        return frame

    @property
    def answer(self) -> Answer:
        """How well the masses stand for the rotor, the masses, and both frequencies beside each other."""
        n = len(self.nodes)
        whole = "" if self.rotor is None else f" of the rotor's {self.rotor.total_mass:.1f} kg"
        told = Answer(
            f"{counted(n, 'equivalent mass', 'equivalent masses')} from {self.choices.words(self.modes)}, "
            f"formula (50), together {self.masses.solution.sum():.1f}{whole or ' kg'}.\n"
            f"{self._judgement()}; condition number {self.masses.condition_number:.3g}.",
            f"{text(self._masses())}\n\n{text(self._modes())}",
            self.warnings[::-1],  # of the model as it came out before those of what it is made for
            (_RESIDUAL,) if self.masses.std is not None else (),
        )
        more = [part.answer for part in (self.uncertainty, self.separated) if part is not None]
        return together([told, *more])

    def _judgement(self) -> str:
        """How near the modes are."""
        errors, macs = np.abs(self.relative_error[: self.modes]), self.mac[: self.modes]
        if (self.masses.solution <= 0).any():
            return "NO physical model, a mass is not positive"
        if not np.isfinite(errors).all():
            return "NO model of these modes, not all of them vibrate"
        whose = "measured" if self.choices.source == "measured" else "rotor's"
        said = f"Frequencies within {percent(round(errors.max(), 8))} % of the {whose}, MAC {macs.min():.4g}"
        k = self.modes
        if k < len(self.nodes) and np.isfinite(self.relative_error[k]):
            said += f"; mode {k + 1} off by {100 * self.relative_error[k]:+.3g} %"
        return said

    def _masses(self) -> tuple[Column, ...]:
        std, positions = self.masses.std, self.positions
        at = () if positions is None else (Column("at, m", positions, "{:.3f}".format),)
        spread = () if std is None else (Column("±", std, error_figures),)
        masses = Column("mass, kg", self.masses.solution, "{:.3f}".format)
        return (Column("node", self.nodes, str), *at, masses, *spread)

    def _modes(self) -> tuple[Column, ...]:
        own, other = self.frequencies, self._padded(self.rotor_frequencies)
        whose = "measured" if self.choices.source == "measured" else "rotor"
        still = ["" if np.isfinite(f) else "does not vibrate" for f in own]
        return (
            Column("mode", range(1, len(self.nodes) + 1), str),
            Column("model", own * RPM, "{:.1f}".format, "model, rpm"),
            Column("rad/s", own, "{:.4f}".format),
            Column("rotor", other * RPM, "{:.1f}".format, f"{whose}, rpm"),
            Column("rotor_rad_s", other, "{:.4f}".format, "rad/s"),
            Column("error", 100 * self.relative_error, "{:+.3f}".format, "error, %"),
            Column("MAC", np.where(np.isfinite(own), self.mac, np.nan), "{:.5f}".format),
            *((Column("", still, str),) if any(still) else ()),
        )

    def _padded(self, values: FloatArray) -> FloatArray:
        out = np.full(len(self.nodes), np.nan)
        out[: len(values)] = values[: len(out)]
        return out
