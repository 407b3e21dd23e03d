"""What `rotorid reduce` prints, writes and draws beside the masses."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rotorid.base.text import counted
from rotorid.plots import plot

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd
    from matplotlib.figure import Figure

    import fem
    from rotorid.reduction import (
        Methods,
        Placement,
        Reduction,
        ResponseCost,
        Shift,
        SmallRotor,
        StabilityCost,
        TradeOff,
    )
    from rotorid.reduction.equivalent.masses import Normalisation

NAMED = ("states", "inputs", "outputs")


@dataclass
class Report:
    """A reduction and what was asked for beside it."""

    result: Reduction
    placement: Placement | None = None
    trade_off: TradeOff | None = None
    methods: Methods | None = None
    response: ResponseCost | None = None
    stability: StabilityCost | None = None
    shift: Shift | None = None
    small: SmallRotor | None = None
    speed: float = 0.0
    both_planes: bool = False
    forces: Sequence[int] = ()

    def add_trade_off(self, normalise: Normalisation, speed: float | None) -> None:
        """Other masses at these nodes: regressions over more or fewer modes, and exact frequencies."""
        from rotorid.reduction import trade_off

        self.trade_off = trade_off(self._rotor, self._nodes, normalise=normalise, speed=speed)

    def add_methods(self, how: Mapping[str, Any], speed: float | None) -> None:
        """Guyan, IRS and SEREP at the same nodes."""
        from rotorid.reduction import compare_methods

        self.methods = compare_methods(self._rotor, self._nodes, modes=self.result.modes, speed=speed, **how)

    def add_small(self, modal_damping: Sequence[float], speed: float | None) -> None:
        """The model in both planes, with what turns, couples and damps."""
        self.small = self.result.small(modal_damping)
        tables = [support.speeds[0] for support in self._rotor.supports if support.speeds]
        self.speed = max(tables, default=0.0) if speed is None else speed

    def add_response(self, speeds: Sequence[float] | None) -> None:
        """Response to unbalance beside the full rotor's."""
        from rotorid.reduction import compare_response

        self.response = compare_response(self._model, speeds)

    def add_stability(self, lowest: float, highest: float) -> None:
        """Eigenvalues over speed beside the full rotor's."""
        from rotorid.reduction import compare_stability

        self.stability = compare_stability(self._model, highest, lowest=lowest)

    @property
    def _rotor(self) -> fem.Rotor:
        if self.result.rotor is None:
            raise ValueError("this needs a rotor: give ROTOR instead of --compliance")
        return self.result.rotor

    @property
    def _nodes(self) -> list[int]:
        return [int(node) for node in self.result.nodes]

    @property
    def _model(self) -> SmallRotor:
        if self.small is None:
            self.add_small((), None)
        assert self.small is not None
        return self.small

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        parts = {
            "what_if": self.shift,
            "placement": self.placement,
            "trade_off": self.trade_off,
            "methods": self.methods,
            "response": self.response,
            "stability": self.stability,
        }
        return {
            **self.result.to_dict(),
            **{key: part.to_dict() for key, part in parts.items() if part is not None},
            **({} if self.small is None else {"small_model": self.small.to_dict()}),
        }

    def text(self) -> str:
        """For the terminal."""
        parts = (
            self.result,
            self.shift,
            self.placement,
            self.trade_off,
            self.methods,
            self.response,
            self.stability,
        )
        blocks = [part.summary() for part in parts if part is not None]
        if self.small is not None:
            blocks.append(self.small.summary())
        return "\n\n".join(blocks)

    def frame(self) -> pd.DataFrame:
        """The ranking where it was asked for, else masses and modes."""
        return self.result.to_frame() if self.placement is None else self.placement.to_frame()

    def figure(self, view: str | None) -> Figure:
        """The picture asked for; by default that of what was asked for last."""
        from matplotlib.figure import Figure

        from rotorid.reduction.dynamics.running_plots import plot_running
        from rotorid.reduction.plots import plot_methods

        parts = {
            "stability": self.stability,
            "response": self.response,
            "methods": self.methods,
            "placement": self.placement,
            "shapes": self.result,
        }
        name = view or next(name for name, part in parts.items() if part is not None)
        if parts[name] is None:
            option = {"placement": "--rank"}.get(name, f"--{name}")
            raise ValueError(f"--view {name} draws what {option} computes: give {option}, too")
        figure = Figure(figsize=(9.5, 6.5 if name in ("methods", "response") else 5.5), layout="constrained")
        if self.methods is not None and name == "methods":
            plot_methods(self.methods, list(figure.subplots(2, sharex=True)))
        elif self.response is not None and name == "response":
            plot_running(self.response, list(figure.subplots(2, sharex=True, height_ratios=(3, 2))))
        else:
            part = {"stability": self.stability, "placement": self.placement}.get(name) or self.result
            plot(part, figure.add_subplot())
        return figure

    def sheet(self, document: dict[str, Any], record: dict[str, Any]) -> bytes:
        """HTML to print, from the document and the provenance."""
        from rotorid.report.reduction import reduce_report

        return reduce_report(
            document,
            self.result,
            provenance=record,
            placement=self.placement,
            methods=self.methods,
            response=self.response,
            stability=self.stability,
        )

    def model_bytes(self, name: str) -> bytes:
        """The small model as a file for `rotorid fit` and `identify`.

        Dampers to be estimated stand at every mass, beginning with 2 % of its critical damping.
        """
        from rotorid.tables.models.model_writing import ode_model_bytes

        if (self.result.masses.solution <= 0).any():
            raise ValueError(
                "a model with a mass that is not positive cannot be written: use other nodes or modes"
            )
        motion = self._motion()
        masses = [f"{axis}{node}" for axis in "xy" for node in self.result.nodes]
        masses = [name for name in masses if name in motion.coordinates]
        critical = {
            x: 2 * np.sqrt(motion.M[i, i] * motion.K[i, i]) for x in masses for i in [motion.index(x)]
        }
        inputs = [f"f_x{node}" for node in self.forces]
        if lost := [name for name in inputs if name.removeprefix("f_") not in masses]:
            raise ValueError(
                f"--force: no mass of the model stands at {lost[0].removeprefix('f_x')}; masses stand at "
                f"{', '.join(map(str, self.result.nodes))}"
            )
        which = "both planes" if any(name.startswith("y") for name in masses) else "the plane x"
        said = [
            f"{name} reduced to masses at nodes {', '.join(map(str, self.result.nodes))} (formula 50, "
            f"{counted(self.result.modes, 'mode')}), {which} at {motion.speed:.6g} rad/s, SI",
            "Put what is known of the start into [initial]; v_x7 is the velocity of x7.",
        ]
        if motion.M.any(axis=0).all() and not inputs:
            said.append("Put forces of time into [force].")
        elif not inputs:
            said.append("Measured forces: write the file with --force NODES.")
        return ode_model_bytes(
            motion,
            {x: float(f"{0.02 * c:.3g}") for x, c in critical.items()},
            {},
            comments=said,
            inputs=inputs,
            outputs=None if set(masses) == set(motion.coordinates) else masses,
        )

    def state_space_bytes(self, path: Path) -> bytes:
        """A, B, C, D in both planes at the speed, in the format that the name of the file asks for."""
        if self.small is None:
            raise ValueError("a state space needs a rotor")
        model = self.small.state_space(self.speed)
        document = model.to_dict()
        if path.suffix.lower() == ".json":
            return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()
        arrays = {key: np.array(value) for key, value in document.items()}
        stream = io.BytesIO()
        if path.suffix.lower() == ".mat":
            from scipy.io import savemat

            named = {key: np.array(value, dtype=object) for key, value in document.items() if key in NAMED}
            savemat(stream, arrays | named)
        else:
            # numpy before 2.1 would store allow_pickle= as an array
            np.savez(stream, **arrays)  # type: ignore[arg-type]
        return stream.getvalue()

    def _motion(self) -> fem.Motion:
        """One plane where nothing couples them; without massless unknowns where no damping acts on them."""
        if self.small is None:
            return self.result.equations_of_motion
        motion = self.small.motion(self.speed)
        y = np.array(["y" in name for name in motion.coordinates])
        across = np.ix_(~y, y)
        coupled = bool(motion.C[across].any() or motion.K[across].any())
        plane: Literal["both", "x"] = "both" if self.both_planes or coupled else "x"
        try:
            return self.small.motion(self.speed, plane, "condensed")
        except ValueError:  # damped supports stay, as states of first order
            return self.small.motion(self.speed, plane)
