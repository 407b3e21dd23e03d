"""Result of `reduce`: the masses, what was asked for beside them, and the small model as files."""

from __future__ import annotations

import dataclasses
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import Answer, together
from rotorid.base.text import counted, listing
from rotorid.base.versions import SCHEMA_VERSION, now
from rotorid.report.outcome import Parts

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.reduction import (
        Methods,
        Placement,
        Reduction,
        ResponseCost,
        Shift,
        SmallModel,
        StabilityCost,
    )

NAMED = ("states", "inputs", "outputs")


@dataclass(frozen=True, eq=False, kw_only=True)
class ReducedRotor(Parts):
    """A reduction, what was asked for beside it, and the small model where it was needed.

    Attributes
    ----------
    result
        The masses.
    placement, methods, response, stability, shift
        What was asked for beside them.
    small
        The model in both planes, with supports, forces and what turns, couples and damps.
    keeps_supports
        Whether its masses are those of the shaft on rigid supports.
    damping
        Its modal damping ratios.
    speed, both_planes, forces, name
        Of the files of the small model: rad/s, whether both planes are written, nodes of forces, the rotor's.
    """

    result: Reduction
    placement: Placement | None = None
    methods: Methods | None = None
    response: ResponseCost | None = None
    stability: StabilityCost | None = None
    shift: Shift | None = None
    small: SmallModel | None = None
    keeps_supports: bool = False
    damping: Sequence[float] = ()
    speed: float = 0.0
    both_planes: bool = False
    forces: Sequence[int | str] = ()
    name: str = ""

    @property
    def parts(self) -> Mapping[str, Any]:
        """The masses, and what was asked for beside them."""
        return {
            "": self.result,
            "what_if": self.shift,
            "placement": self.placement,
            "methods": self.methods,
            "response": self.response,
            "stability": self.stability,
            "small_model": self.small,
        }

    @property
    def answer(self) -> Answer:
        """The ranking where it was asked for, before the masses at its compromise."""
        first = [] if self.placement is None else [self.placement.answer]
        if self.keeps_supports and self.result.rotor is not None:
            at = listing((str(support.node) for support in self.result.rotor.supports), "and")
            first.append(Answer(f"The shaft held rigidly at nodes {at}, without its supports and forces:"))
        rest = (part for part in self.parts.values() if part not in (None, self.placement))
        return together([*first, *(part.answer for part in rest)])

    def to_frame(self) -> pd.DataFrame:
        """The ranking where it was asked for, else masses and modes."""
        return self.result.to_frame() if self.placement is None else self.placement.to_frame()

    def figure(self) -> Figure:
        """The last of what was asked for: stability, response, methods, places, or the shapes."""
        from rotorid.base.plot_style import new_figure
        from rotorid.plots import plot

        parts = (self.stability, self.response, self.methods, self.placement, self.result)
        part: Any = next(part for part in parts if part is not None)
        ratios = (1, 1) if part is self.methods else (3, 2)
        two = part is self.methods or part is self.response
        figure = new_figure(6.2 if two else 5.0)
        pair = [*figure.subplots(2, sharex=True, height_ratios=ratios)] if two else figure.add_subplot()
        plot(part, pair)
        return figure

    def sheet(self) -> bytes:
        """To print: one HTML file."""
        from rotorid.report.reduction import reduce_report

        return reduce_report(self.to_dict(), self.parts, self.provenance)

    def with_small(self) -> ReducedRotor:
        """The same with the small model, which needs a rotor.

        Raises
        ------
        ValueError
            Without a rotor, or with masses that are not positive.
        """
        from rotorid.reduction import small_model

        if self.small is not None:
            return self
        rotor, nodes = self.result.rotor, [int(node) for node in self.result.nodes]
        if rotor is None:
            raise ValueError(
                "measured modes and a compliance alone say nothing of bearings and the second plane: "
                "give a rotor"
            )
        model = small_model(rotor, nodes, self.result.masses.solution, modal_damping=self.damping)
        return dataclasses.replace(self, small=model)

    def model_files(self, path: Path, name: str = "") -> dict[Path, bytes]:
        """The small model as a file, with tables of supports over speed; `name`: of the rotor.

        For `fit` dampers to be estimated stand at every mass, beginning with 2 % of its critical damping.
        Without a rotor it is a file of equations.

        Raises
        ------
        ValueError
            For masses that are not positive, and forces where no mass stands.
        """
        from rotorid.tables.models.model_writing import ode_model_bytes
        from rotorid.tables.models.small_model_file import linear_equations, small_model_files

        made = (
            f"{name} reduced to masses at nodes {', '.join(map(str, self.result.nodes))} (formula 50, "
            f"{counted(self.result.modes, 'mode')})"
        )
        if self.keeps_supports and self.small is not None:
            return small_model_files(path, self.small, [f"{made}, its supports kept, SI"])
        if (self.result.masses.solution <= 0).any():
            raise ValueError(
                "a model with a mass that is not positive cannot be written: use other nodes or modes"
            )
        small, motion = self.small, self.result.equations_of_motion
        if small is not None:
            motion = linear_equations(small, self.speed, self.both_planes)
        masses = [f"{axis}{node}" for axis in "xy" for node in self.result.nodes]
        masses = [x for x in masses if x in motion.coordinates]
        critical = {
            f"d_{x}": 2 * math.sqrt(motion.M[i, i] * motion.K[i, i])
            for x in masses
            for i in [motion.index(x)]
        }
        estimate = {x: float(f"{0.02 * c:.3g}") for x, c in critical.items()}
        inputs = [f"f_x{node}" for node in self.forces]
        if lost := [x for x in inputs if x.removeprefix("f_") not in masses]:
            raise ValueError(
                f"--force: no mass of the model stands at {lost[0].removeprefix('f_x')}; masses stand at "
                f"{', '.join(map(str, self.result.nodes))}"
            )
        if small is None:
            dampers = {x.removeprefix("d_"): value for x, value in estimate.items()}
            content = ode_model_bytes(motion, dampers, comments=[f"{made}, the plane x, SI"], inputs=inputs)
            return {path: content}
        equations: dict[str, Any] = {
            "speed_rad_s": self.speed,
            "both_planes": self.both_planes,
            "inputs": inputs,
            "estimate": estimate,
            "bounds": {x: [0.0, math.inf] for x in estimate},
        }
        comments = [
            f"{made}, SI",
            "For fit, identify and simulate: what is known of the start stands in [equations.initial], where "
            "v_x7 is the velocity of x7; forces of time in [equations.force]; measured ones: --force NODES.",
        ]
        return small_model_files(path, small, comments, {k: v for k, v in equations.items() if v})

    def further_file(self, option: str, path: Path) -> bytes | Mapping[Path, bytes]:
        """The small model, or its state space."""
        if option == "state_space":
            return self.state_space_bytes(path.suffix.lower())
        return self.model_files(path, self.name)

    def state_space_bytes(self, ending: str = ".json") -> bytes:
        """A, B, C, D in both planes at the speed, as a file that ends in .json, .npz or .mat."""
        import numpy as np

        small = self.with_small().small
        assert small is not None
        document = {"schema_version": SCHEMA_VERSION, **small.state_space(self.speed).to_dict()}
        if ending == ".json":
            return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()
        arrays = {key: np.array(value) for key, value in document.items()}
        stream = io.BytesIO()
        if ending == ".mat":
            from scipy.io import savemat

            named = {key: np.array(value, dtype=object) for key, value in document.items() if key in NAMED}
            savemat(stream, arrays | named)
            # the text at the top, of 116 bytes, has the date of the clock
            head = f"MATLAB 5.0 MAT-file, written by rotorid, {now():%Y-%m-%d %H:%M:%S} UTC"
            return head.encode().ljust(116) + stream.getvalue()[116:]
        # numpy before 2.1 would store allow_pickle= as an array
        np.savez(stream, **arrays)  # type: ignore[arg-type]
        return stream.getvalue()
