"""`reduce`: a rotor as a few masses, how good they are, and the small model to go on with."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rotorid.workflows.outcome import Outcome, log, provenance, workflow
from rotorid.workflows.parameters import Band, Nodes, Speeds, band, nodes, one_of, one_speed, rising_speeds
from rotorid.workflows.sources import rotor_source

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    import fem
    from fem import Rotor
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

Place = Literal["best", "compromise", "mac", "book"]
"""Which of all places of the masses is taken."""
Normalise = Literal["first", "largest", "length"]
"""How shapes are scaled."""
Rows = Literal["equal", "relative"]
"""How rows of the regression are weighted."""
View = Literal["shapes", "methods", "placement", "response", "stability"]
"""What a picture shows."""


@dataclass(frozen=True)
class ReduceOptions:
    """Options of `reduce`.

    Attributes
    ----------
    nodes
        Where the masses stand: "7,12,18", or nodes and stations.
    place
        Instead, of all places: the best by frequency, by MAC, a compromise, or the book's rule.
    masses
        How many masses `place` and `rank` set; None: 3.
    modes
        How many modes the regression uses; None: 2.
    normalise, rows, nonnegative, supports_apart
        As in `rotorid.reduce`.
    measured
        Table of measured modes, used instead of computed ones.
    compliance
        Without a rotor: table of compliance, with `measured`.
    seals
        With `compliance`: springs to the ground that it does not hold, "12=2e6" or `{12: 2e6}`, N/m.
    errors
        Standard deviations of the inputs: "compliance=1.3" in percent, or shares, `{"compliance": 0.013}`.
    what_if
        Changes of inputs: "alpha12=1.3" in percent, or shares.
    speed
        Of tables of bearings and seals and of the small model, "3000rpm" or rad/s; None: the lowest of the
        tables.
    rank
        Rank all places of the masses.
    candidates
        Nodes that `rank` and `place` choose from.
    trade_off
        Other masses at these nodes: frequencies against shapes.
    methods
        Guyan, IRS and SEREP beside.
    response
        Speeds of a response beside the full rotor's, "100:700:50" or rad/s, or "auto".
    stability
        Speeds of stability beside the full rotor's, "0:9000rpm" or rad/s.
    damping
        Modal damping of the small model: "1,0.5" in percent of critical of the first modes, or ratios.
    both_planes
        Planes x and y in the model file, also where nothing couples them.
    force
        Nodes of measured forces, inputs of the model file.
    """

    nodes: Nodes | None = None
    place: Place | None = None
    masses: int | None = None
    modes: int | None = None
    normalise: Normalise = "first"
    rows: Rows = "equal"
    nonnegative: bool = False
    supports_apart: bool = False
    measured: Path | str | None = None
    compliance: Path | str | None = None
    seals: str | Mapping[str, float] | None = None
    errors: str | Mapping[str, float] | None = None
    what_if: str | Mapping[str, float] | None = None
    speed: str | float | None = None
    rank: bool = False
    candidates: Nodes | None = None
    trade_off: bool = False
    methods: bool = False
    response: Speeds | None = None
    stability: Band | None = None
    damping: str | Sequence[float] | None = None
    both_planes: bool = False
    force: Nodes | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class ReducedRotor(Outcome):
    """A reduction, what was asked for beside it, and the small model where it was needed.

    Attributes
    ----------
    result
        The masses.
    placement, trade_off, methods, response, stability, shift
        What was asked for beside them.
    small
        The model in both planes, with what turns, couples and damps.
    damping
        Its modal damping ratios.
    speed
        Of the small model, rad/s.
    both_planes, forces
        Of the model file.
    """

    result: Reduction
    placement: Placement | None = None
    trade_off: TradeOff | None = None
    methods: Methods | None = None
    response: ResponseCost | None = None
    stability: StabilityCost | None = None
    shift: Shift | None = None
    small: SmallRotor | None = None
    damping: Sequence[float] = ()
    speed: float = 0.0
    both_planes: bool = False
    forces: Sequence[int | str] = ()

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        parts = {
            "what_if": self.shift,
            "placement": self.placement,
            "trade_off": self.trade_off,
            "methods": self.methods,
            "response": self.response,
            "stability": self.stability,
            "small_model": self.small,
        }
        beside = {key: part.to_dict() for key, part in parts.items() if part is not None}
        return self.result.to_dict() | beside

    def summary(self) -> str:
        """For the terminal."""
        parts = (
            self.result,
            self.shift,
            self.placement,
            self.trade_off,
            self.methods,
            self.response,
            self.stability,
            self.small,
        )
        return "\n\n".join(part.summary() for part in parts if part is not None)

    def to_frame(self) -> pd.DataFrame:
        """The ranking where it was asked for, else masses and modes."""
        return self.result.to_frame() if self.placement is None else self.placement.to_frame()

    def figure(self, view: View | None = None) -> Figure:
        """The picture asked for; by default that of what was asked for last.

        Raises
        ------
        ValueError
            For a view of what was not computed.
        """
        from matplotlib.figure import Figure

        from rotorid.plots import plot

        parts = {
            "stability": self.stability,
            "response": self.response,
            "methods": self.methods,
            "placement": self.placement,
            "shapes": self.result,
        }
        last = next(name for name, part in parts.items() if part is not None)
        name: str = view or last
        if parts[one_of(name, "view", [*parts])] is None:
            option = {"placement": "--rank"}.get(name, f"--{name}")
            raise ValueError(f"--view {name} draws what {option} computes: give {option}, too")
        heights = {"methods": (1, 1), "response": (3, 2)}.get(name)
        figure = Figure(figsize=(9.5, 6.5 if heights else 5.5), layout="constrained")
        axes = [*figure.subplots(2, sharex=True, height_ratios=heights)] if heights else figure.add_subplot()
        plot(parts[name], axes)
        return figure

    def sheet(self) -> bytes:
        """To print: one HTML file."""
        from rotorid.report.reduction import reduce_report

        return reduce_report(
            self.to_dict(),
            self.result,
            provenance=self.provenance,
            placement=self.placement,
            methods=self.methods,
            response=self.response,
            stability=self.stability,
        )

    def with_small(self) -> ReducedRotor:
        """The same with the small model.

        Raises
        ------
        ValueError
            Without a rotor.
        """
        return self if self.small else dataclasses.replace(self, small=self.result.small(self.damping))

    def model_bytes(self, name: str = "") -> bytes:
        """The small model as a file for `fit` and `identify`; `name` of the rotor for its comment."""
        from rotorid.tables.models.reduced_model import reduced_model_bytes

        return reduced_model_bytes(
            self.result,
            self.small,
            self.speed,
            both_planes=self.both_planes,
            forces=self.forces,
            name=name,
        )

    def state_space_bytes(self, ending: str = ".json") -> bytes:
        """A, B, C, D in both planes at the speed, in the format of a file with this ending."""
        from rotorid.tables.models.state_space_file import state_space_bytes

        small = self.with_small().small
        assert small is not None
        return state_space_bytes(small.state_space(self.speed), ending)


@workflow
def reduce(rotor: Rotor | Path | str | None = None, options: ReduceOptions | None = None) -> ReducedRotor:
    """Find equivalent masses at chosen nodes (formula 50), how good they are, and the small model.

    The formula is one of a plane at rest; bearings, seals, gyroscopic effect and damping come back with the
    small model.

    Parameters
    ----------
    rotor
        A rotor, a rotor table or a rotor file; None: compliance and modes are given by tables.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be, and for options that would have no effect.
    """
    from rotorid.workflows.reduce_inputs import from_tables, shares

    options = options or ReduceOptions()
    how = {"normalise": options.normalise, "rows": options.rows, "nonnegative": options.nonnegative}
    _check_used(options, rotor is not None)
    if rotor is None:
        result, files = from_tables(options, how)
        forces = nodes(options.force or (), "--force")
        found = ReducedRotor(result=result, forces=forces, provenance=provenance(files, options))
    else:
        found = _of_rotor(rotor, options, how)
    solved = found.result.masses
    log.info("rank = %s", solved.rank)
    log.info("degrees_of_freedom = %s", solved.dof)
    log.info("singular_values = %s", ", ".join(f"{value:.6g}" for value in solved.singular_values))
    if options.what_if is None:
        return found
    changes = shares(options.what_if, "--what-if", "alpha12=1.3")
    return dataclasses.replace(found, shift=found.result.what_if(changes))


def _check_used(options: ReduceOptions, has_rotor: bool) -> None:
    """Refuse options that would have no effect."""
    computed = ("rank", "place", "methods", "trade_off", "response", "stability")
    of_rotor = (*computed, "candidates", "damping", "both_planes", "supports_apart", "speed")
    asked = {name: getattr(options, name) for name in of_rotor}
    given = [name for name, value in asked.items() if value is not None and value is not False]
    if not has_rotor and given:
        raise ValueError(f"{_option(given[0])} needs a rotor: give ROTOR instead of --compliance")
    if has_rotor and (options.compliance is not None or options.seals is not None):
        raise ValueError("--compliance and --seals take the place of a rotor: give them, or ROTOR, not both")
    for name in ("masses", "candidates"):
        if getattr(options, name) is not None and not options.rank and options.place is None:
            raise ValueError(f"--{name} does nothing without --rank or --place")
    if options.measured is not None and given and given[0] in computed:
        raise ValueError(
            f"{_option(given[0])} compares with the computed rotor, not with the measured modes: "
            f"leave out {_option(given[0])} or --measured"
        )


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _of_rotor(rotor: Rotor | Path | str, options: ReduceOptions, how: Mapping[str, Any]) -> ReducedRotor:
    """The masses of a rotor, and what is asked for beside them."""
    from rotorid.reduction import rank_nodes
    from rotorid.reduction import reduce as reduce_rotor
    from rotorid.tables.data.modes_table import read_modes
    from rotorid.workflows import reduce_inputs as given

    machine, files = rotor_source(rotor)
    at = None if options.speed is None else one_speed(options.speed, "--speed")
    data = None if options.measured is None else read_modes(options.measured, machine)
    placement = None
    if options.rank or options.place is not None:
        masses = options.masses or 3
        candidates = None if options.candidates is None else nodes(options.candidates, "--candidates")
        placement = rank_nodes(
            machine,
            masses,
            options.modes or min(2, masses),
            candidates=candidates,
            speed=at,
            normalise=options.normalise,
            rows=options.rows,
        )
    places = given.places(machine, options, placement, data, at)
    used = min(2, len(places)) if options.modes is None else options.modes
    if data is not None and options.measured is not None:
        files = (*files, Path(options.measured))
        data = given.at(data, machine, places, options.measured)
    result = reduce_rotor(
        machine,
        places,
        used,
        speed=at,
        supports_apart=options.supports_apart,
        measured=None if data is None else (data.frequencies, data.shapes),
        errors=given.errors(options.errors, data, used, len(places)),
        **how,
    )
    tables = [support.speeds[0] for support in machine.supports if support.speeds]
    found = ReducedRotor(
        result=result,
        placement=placement if options.rank else None,
        damping=given.damping_ratios(options.damping),
        speed=max(tables, default=0.0) if at is None else at,
        both_planes=options.both_planes,
        forces=[machine.node(node) for node in nodes(options.force or (), "--force")],
        provenance=provenance(files, options),
    )
    return _beside(found, machine, options, at)


def _beside(found: ReducedRotor, rotor: fem.Rotor, options: ReduceOptions, at: float | None) -> ReducedRotor:
    """With other masses, other methods, response and stability as asked for."""
    from rotorid.reduction import compare_methods, compare_response, compare_stability, trade_off

    places = [int(node) for node in found.result.nodes]
    how: dict[str, Any] = {"normalise": options.normalise, "speed": at}
    if options.trade_off:
        found = dataclasses.replace(found, trade_off=trade_off(rotor, places, **how))
    if options.methods:
        methods = compare_methods(rotor, places, modes=found.result.modes, rows=options.rows, **how)
        found = dataclasses.replace(found, methods=methods)
    if found.damping or options.response is not None or options.stability is not None:
        found = found.with_small()
    if found.small is not None and options.response is not None:
        automatic = str(options.response) == "auto"
        speeds = None if automatic else rising_speeds(options.response, "--response")
        found = dataclasses.replace(found, response=compare_response(found.small, speeds))
    stable = band(options.stability, "--stability")
    if found.small is not None and stable is not None:
        low, high = stable
        found = dataclasses.replace(found, stability=compare_stability(found.small, high, lowest=low))
    return found
