"""Result of `reduce`: the masses, what was asked for beside them, and the small model as files."""

from __future__ import annotations

import dataclasses
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import Answer, together
from rotorid.base.text import counted, listing
from rotorid.base.versions import SCHEMA_VERSION, now
from rotorid.commands.outcome import Parts

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    import fem
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
    speed, both_planes, forces
        Of the files of the small model: rad/s, whether both planes are written, nodes of forces.
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

    def model_bytes(self, name: str = "") -> bytes:
        """The small model as a file for `fit` and `identify`, or that for motion; `name`: of the rotor.

        For `fit` dampers to be estimated stand at every mass, beginning with 2 % of its critical damping.
        """
        import numpy as np

        from rotorid.tables.models.model_writing import ode_model_bytes
        from rotorid.tables.models.small_model_file import small_model_bytes

        made = (
            f"{name} reduced to masses at nodes {', '.join(map(str, self.result.nodes))} (formula 50, "
            f"{counted(self.result.modes, 'mode')})"
        )
        if self.keeps_supports and self.small is not None:
            return small_model_bytes(self.small, [f"{made}, its supports kept, SI"])
        if (self.result.masses.solution <= 0).any():
            raise ValueError(
                "a model with a mass that is not positive cannot be written: use other nodes or modes"
            )
        motion = self._motion()
        masses = [f"{axis}{node}" for axis in "xy" for node in self.result.nodes]
        masses = [name for name in masses if name in motion.coordinates]
        stiff, heavy = np.diag(motion.K), np.diag(motion.M)
        dampers = {
            x: float(f"{0.04 * math.sqrt(heavy[i] * stiff[i]):.3g}")
            for x in masses
            for i in [motion.index(x)]
        }
        if lost := [node for node in self.forces if f"x{node}" not in masses]:
            raise ValueError(
                f"--force: no mass of the model stands at {lost[0]}; masses stand at "
                f"{', '.join(map(str, self.result.nodes))}"
            )
        which = "the plane x" if masses[-1].startswith("x") else "both planes"
        comments = [
            f"{made}, {which} at {motion.speed:.6g} rad/s, SI",
            "Put what is known of the start into [initial]; v_x7 is the velocity of x7.",
        ]
        if not self.forces:
            massive = motion.M.any(axis=0).all()
            with_time = "Put forces of time into [force]."
            comments.append(with_time if massive else "Measured forces: write the file with --force NODES.")
        return ode_model_bytes(
            motion,
            dampers,
            comments=comments,
            inputs=[f"f_x{node}" for node in self.forces],
            outputs=None if set(masses) == set(motion.coordinates) else masses,
        )

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

    def _motion(self) -> fem.Motion:
        """One plane where nothing couples them; without massless unknowns where no damping acts on them."""
        import numpy as np

        if self.small is None:
            return self.result.equations_of_motion
        motion = self.small.motion(self.speed)
        y = np.array(["y" in name for name in motion.coordinates])
        across = np.ix_(~y, y)
        coupled = bool(motion.C[across].any() or motion.K[across].any())
        plane = "both" if self.both_planes or coupled else "x"
        try:
            return self.small.motion(self.speed, plane, condensed=True)
        except ValueError:  # damped supports stay, as states of first order
            return self.small.motion(self.speed, plane)
