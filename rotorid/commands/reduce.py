"""`reduce`: a rotor as a few masses, how good they are, and the small model to go on with."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from rotorid.base.logs import workflows as log
from rotorid.base.text import counted
from rotorid.commands.quantities import (
    Band,
    Nodes,
    Speeds,
    band,
    nodes,
    number,
    numbers,
    one_of,
    one_speed,
    option_name,
    rising_speeds,
)
from rotorid.report.options import rotor_source
from rotorid.report.outcome import EQUATIONS, WITH_REPORT, command, provenance

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.commands.reduce_result import ReducedRotor
    from rotorid.reduction import InputErrors, Placement, Reduction
    from rotorid.tables.data.modes_table import MeasuredModes

Place = Literal["best", "compromise", "mac", "book"]
"""Which of all places of the masses is taken."""
Normalise = Literal["first", "largest", "length"]
"""How shapes are scaled."""
Rows = Literal["equal", "relative"]
"""How rows of the regression are weighted."""
ERRORS = ("compliance", "frequencies", "shapes", "seal_stiffness")


@dataclass(frozen=True)
class ReduceOptions:
    """Options of `reduce`.

    Attributes
    ----------
    nodes : LIST
        Where the masses stand: nodes or stations, 7,12,18.
    place
        Instead of nodes, of all places: best by frequency, best by MAC, a compromise, or the book's rule
        (extrema of the first two modes).
    masses : N from 1
        How many masses are placed or ranked; default: 3.
    modes : N from 1
        How many modes the regression uses; default: 2.
    normalise
        Shapes scaled to 1 at the first mass (the book), at their largest, or in length.
    rows
        Rows of the regression as they stand (the book: the first mode dominates), or of each mode relative
        to its 1/ω².
    nonnegative
        No mass below 0.
    supports_apart
        Compliance of the shaft and its two bearings apart, (47).
    measured : FILE
        Table of measured modes (mode, frequency_rad_s, node, shape), used instead of computed ones.
    compliance : FILE
        Without a rotor, with measured modes: table node, force_node, compliance_m_per_N.
    seals : LIST
        With a table of compliance: springs to the ground that it does not hold, N/m, 12=2e6.
    errors : LIST
        Standard deviations of the inputs in percent: compliance=1.3,shapes=1,frequencies=0.1.
    what_if : LIST
        What changes of inputs do, in percent: alpha12=1.3,U31=-0.3.
    speed : SPEED
        Of tables of bearings and seals, and of the small model, such as 3000rpm; default: the lowest of the
        tables.
    rank
        Rank all places of the masses.
    candidates : LIST
        Nodes that places are chosen from.
    methods
        Beside other reductions.
    response : A:B:STEP
        Unbalance response beside the full rotor's, at speeds in rad/s or with a unit; or auto.
    stability : A:B
        Stability beside the full rotor's, 0:9000rpm.
    damping : LIST
        Modal damping of the small model, percent of critical of the first modes: 1,0.5.
    both_planes
        Planes x and y in the model file, also where nothing couples them.
    force : LIST
        Nodes of measured forces, inputs f_x12 of the model file, 12 or 7,12.
    keep_supports
        For motion: masses of the shaft alone, estimated with rigid bearings in place of bearings and films;
        all supports and forces stay in the model, at nodes of their own.
    model : FILE.toml
        Write the small model for `rotorid motion`, `periodic`, `bearings`, and for `fit`, `identify` and
        `simulate`, a damper to be estimated at each mass.
    state_space : FILE
        Write A, B, C, D in both planes: .json, .npz or .mat.
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
    methods: bool = False
    response: Speeds | None = None
    stability: Band | None = None
    damping: str | Sequence[float] | None = None
    both_planes: bool = False
    force: Nodes | None = None
    keep_supports: bool = False
    model: Path | None = None
    state_space: Path | None = None
    panels: ClassVar[Mapping[str, str]] = {
        "Input": "nodes modes speed measured compliance seals",
        "Method": "rank place masses candidates methods",
        "Errors": "errors what_if",
        "Small model": "response stability model state_space damping force both_planes keep_supports",
        "Expert": "normalise rows nonnegative supports_apart",
    }
    to: ClassVar[Sequence[str]] = (*WITH_REPORT, *EQUATIONS)
    writes: ClassVar[Mapping[str, Sequence[str]]] = {
        "model": (".toml",),
        "state_space": (".json", ".npz", ".mat"),
    }

    def before(self, rotor: Path | None) -> None:
        """Refuse what would be in no file."""
        used = {
            "--damping": (self.damping, self.model or self.state_space, "--model or --state-space"),
            "--both-planes": (self.both_planes, self.model, "--model"),
            "--force": (self.force, self.model, "--model"),
        }
        for option, (given, of_use, needed) in used.items():
            if given and not of_use:
                raise ValueError(f"{option} does nothing without {needed}")
        if self.keep_supports and self.state_space:
            raise ValueError("--state-space writes the rotor on its supports: leave out --keep-supports")


@command
def reduce(rotor: Rotor | Path | str | None = None, options: ReduceOptions | None = None) -> ReducedRotor:
    """A rotor as a few masses at chosen nodes (formula 50), and how good they are.

    The formula is one of a plane at rest; bearings, seals, gyroscopic effect and damping come back with the
    small model (--response, --stability, --model, --state-space). With --keep-supports bearings, films and
    other forces stay apart from the masses, for motion.

    Example: rotorid reduce sample_data/rotor23.csv --nodes 7,12,18 --modes 2

    Example: rotorid reduce sample_data/rotor23.csv --rank --plot map.png

    Parameters
    ----------
    rotor : ROTOR
        Rotor table (.csv, .xlsx) or rotor file (.toml); not needed with --compliance.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be, and for options that would have no effect.
    """
    from rotorid.commands.reduce_result import ReducedRotor

    options = options or ReduceOptions()
    how = {"normalise": options.normalise, "rows": options.rows, "nonnegative": options.nonnegative}
    _check_used(options, rotor is not None)
    if rotor is None:
        result, files = _of_tables(options, how)
        forces = _forces(options)
        reduced = ReducedRotor(result=result, forces=forces, provenance=provenance(files, options))
    else:
        reduced = _of_rotor(rotor, options, how)
        if options.model or options.state_space:
            name = Path(rotor).name if isinstance(rotor, Path | str) else ""
            reduced = dataclasses.replace(reduced.with_small(), name=name)
    solved = reduced.result.masses
    log.info("rank = %s", solved.rank)
    log.info("degrees_of_freedom = %s", solved.dof)
    log.info("singular_values = %s", ", ".join(f"{value:.6g}" for value in solved.singular_values))
    if options.what_if is None:
        return reduced
    changes = shares(options.what_if, "--what-if", "alpha12=1.3")
    return dataclasses.replace(reduced, shift=reduced.result.what_if(changes))


def _check_used(options: ReduceOptions, has_rotor: bool) -> None:
    """Refuse options that would have no effect."""
    computed = ("rank", "place", "methods", "response", "stability")
    given = [name for name, value in vars(options).items() if value is not None and value is not False]
    of_rotor = (*computed, "candidates", "damping", "both_planes", "supports_apart", "speed", "keep_supports")
    on_supports = ("measured", "supports_apart", "speed", "response", "stability", "both_planes", "force")
    ranks = options.rank or options.place is not None
    wrong = (
        (not has_rotor, of_rotor, "needs a rotor: give ROTOR instead of --compliance"),
        (has_rotor, ("compliance", "seals"), "takes the place of a rotor: give it, or ROTOR, not both"),
        (not ranks, ("masses", "candidates"), "does nothing without --rank or --place"),
        (
            options.keep_supports,
            on_supports,
            "asks for the rotor on its supports; with --keep-supports the masses are found on rigid ones: "
            "leave out one of them",
        ),
        (
            options.measured is not None,
            computed,
            "compares with the computed rotor, not with the measured modes: leave out one of them",
        ),
    )
    for case, names, words in wrong:
        if case and (first := next((name for name in names if name in given), None)):
            raise ValueError(f"{option_name(first)} {words}")


def _forces(options: ReduceOptions) -> list[str | int]:
    return [] if options.force is None else nodes(options.force, "--force")


def _of_rotor(rotor: Rotor | Path | str, options: ReduceOptions, how: Mapping[str, Any]) -> ReducedRotor:
    """The masses of a rotor, and what is asked for beside them."""
    from rotorid.commands.reduce_result import ReducedRotor
    from rotorid.reduction import check_free, held_nodes, held_rigidly, keep_supports
    from rotorid.reduction import reduce as reduce_rotor
    from rotorid.tables.data.modes_table import read_modes

    whole, files = rotor_source(rotor)
    machine, held = whole, held_nodes(whole) if options.keep_supports else ()
    if options.keep_supports:
        machine = held_rigidly(whole)
    elif whole.forces:
        raise ValueError(
            "forces that are not linear act on this rotor: reduce it with --keep-supports, which finds the "
            "masses on rigid supports, or reduce the linear rotor that `rotorid bearings --output` writes"
        )
    at = None if options.speed is None else one_speed(options.speed, "--speed")
    data = None if options.measured is None else read_modes(options.measured, machine)
    placement, places = _places(machine, options, data, at, held)
    check_free(held, places)
    used = min(2, len(places)) if options.modes is None else options.modes
    if data is not None and options.measured is not None:
        files = (*files, Path(options.measured))
        data = modes_at(data, machine, places, options.measured)
    result = reduce_rotor(
        machine,
        places,
        used,
        speed=at,
        supports_apart=options.supports_apart,
        measured=None if data is None else (data.frequencies, data.shapes),
        errors=input_errors(options.errors, data, used),
        **how,
    )
    tables = [support.speeds[0] for support in machine.supports if support.speeds]
    reduced = ReducedRotor(
        result=result,
        placement=placement if options.rank else None,
        damping=damping_ratios(options.damping),
        speed=max(tables, default=0.0) if at is None else at,
        both_planes=options.both_planes,
        forces=[machine.node(node) for node in _forces(options)],
        provenance=provenance(files, options),
    )
    if options.keep_supports:
        model = keep_supports(whole, places, result.masses.solution, modal_damping=reduced.damping)
        reduced = dataclasses.replace(reduced, small=model, keeps_supports=True)
    return _beside(reduced, machine, options, at)


def _places(
    rotor: Rotor,
    options: ReduceOptions,
    data: MeasuredModes | None,
    speed: float | None,
    held: Sequence[int],
) -> tuple[Placement | None, list[int]]:
    """The ranking if it is needed, and nodes of the masses: as given, by rule, or of the measured shapes."""
    from rotorid.reduction import book_nodes, rank_nodes

    if options.nodes is not None and options.place is not None:
        raise ValueError("--nodes and --place are two ways to the same end: choose one")
    masses, placement = 3 if options.masses is None else options.masses, None
    if options.rank or options.place not in (None, "book"):
        candidates: Sequence[int | str] = [n for n in range(1, rotor.n_nodes + 1) if n not in held]
        placement = rank_nodes(
            rotor,
            masses,
            min(2, masses) if options.modes is None else options.modes,
            candidates=candidates
            if options.candidates is None
            else nodes(options.candidates, "--candidates"),
            speed=speed,
            normalise=options.normalise,
            rows=options.rows,
        )
    if options.nodes is not None:
        return placement, [rotor.node(node) for node in nodes(options.nodes, "--nodes")]
    if options.place == "book":
        return placement, list(book_nodes(rotor, masses, speed=speed))
    if placement is not None:
        bests = {"mac": placement.best_by_mac, "best": placement.best_by_frequency}
        which = bests.get(options.place or "", placement.compromise)
        if which is None:
            raise ValueError(
                f"no choice of {counted(masses, 'node')} gives positive masses with "
                f"{counted(placement.modes, 'mode')}: use other --modes or --masses"
            )
        return placement, placement.nodes[which].tolist()
    if data is not None:
        return None, [rotor.node(node) for node in data.nodes]
    raise ValueError(
        "say where the masses stand: --nodes 7,12,18, or --place best, compromise, mac or book, or --rank"
    )


def _of_tables(options: ReduceOptions, how: Mapping[str, Any]) -> tuple[Reduction, tuple[Path, ...]]:
    """A reduction without a rotor: its compliance and its modes from tables."""
    from rotorid.reduction import reduce_measured
    from rotorid.tables.data.modes_table import read_compliance, read_modes

    if options.compliance is None or options.measured is None:
        raise ValueError("give a rotor, or --compliance and --measured, which take its place")
    data = read_modes(options.measured)
    wanted = list(data.nodes)
    if options.nodes is not None:
        labels = [str(node) for node in nodes(options.nodes, "--nodes")]
        named = {str(node): node for node in data.nodes}
        wanted = [named.get(label, label) for label in labels]
    data = modes_at(data, None, wanted, options.measured)
    known, alpha = read_compliance(options.compliance, wanted)
    order = [known.index(node) for node in wanted]
    used = min(2, len(data.frequencies), len(wanted)) if options.modes is None else options.modes
    springs = {str(node): k for node, k in numbers(options.seals or {}, "--seals", "12=2e6").items()}
    lost = [name for name in springs if name not in map(str, wanted)]
    if lost:
        raise ValueError(
            f"--seals: no mass stands at {lost[0]!r}; masses stand at {', '.join(map(str, wanted))}"
        )
    result = reduce_measured(
        alpha[order][:, order],
        data.frequencies,
        data.shapes,
        used,
        nodes=wanted,
        seal_stiffness=[springs.get(str(node), 0.0) for node in wanted],
        errors=input_errors(options.errors, data, used),
        **how,
    )
    return result, (Path(options.compliance), Path(options.measured))


def _beside(reduced: ReducedRotor, rotor: Rotor, options: ReduceOptions, at: float | None) -> ReducedRotor:
    """With other methods, response and stability as asked for."""
    from rotorid.reduction import compare_methods, compare_response, compare_stability

    places = [int(node) for node in reduced.result.nodes]
    how: dict[str, Any] = {"normalise": options.normalise, "rows": options.rows, "speed": at}
    beside: dict[str, Any] = {}
    if options.methods:
        beside["methods"] = compare_methods(rotor, places, modes=reduced.result.modes, **how)
    stable = band(options.stability, "--stability")
    if reduced.damping or options.response is not None or stable is not None:
        reduced = reduced.with_small()
        assert reduced.small is not None
        if options.response is not None:
            automatic = str(options.response) == "auto"
            speeds = None if automatic else rising_speeds(options.response, "--response")
            beside["response"] = compare_response(rotor, reduced.small, speeds)
        if stable is not None:
            beside["stability"] = compare_stability(rotor, reduced.small, stable[1], lowest=stable[0])
    return dataclasses.replace(reduced, **beside)


def modes_at(data: MeasuredModes, rotor: Rotor | None, wanted: list[Any], path: Path | str) -> MeasuredModes:
    """The measured modes at these places only, in their order."""
    known = [rotor.node(node) for node in data.nodes] if rotor is not None else list(data.nodes)
    lost = [str(node) for node in wanted if node not in known]
    if lost:
        raise ValueError(
            f"{path}: no shape was measured at {', '.join(lost)}; there are {', '.join(map(str, known))}"
        )
    rows = [known.index(node) for node in wanted]
    return dataclasses.replace(
        data,
        nodes=tuple(wanted),
        shapes=data.shapes[rows],
        shape_std=None if data.shape_std is None else data.shape_std[rows],
    )


def input_errors(
    given: str | Mapping[str, float] | None, data: MeasuredModes | None, modes: int
) -> InputErrors | None:
    """Read "compliance=1.3,shapes=1" in percent; what the table of modes states counts elsewhere."""
    from rotorid.reduction import InputErrors

    stated: dict[str, Any] = {}
    if data is not None and data.frequency_std is not None:
        stated["frequencies"] = data.frequency_std[:modes]
    if data is not None and data.shape_std is not None:
        stated["shapes"] = data.shape_std[:, :modes]
    for name, value in shares(given or {}, "--errors", "compliance=1.3,shapes=1").items():
        if not 0 <= value < 1:
            raise ValueError(
                f"--errors: {name}={100 * value:g} is no standard deviation from 0 to 100 percent"
            )
        stated[one_of(name, "--errors", ERRORS)] = value
    return InputErrors(**stated) if stated else None


def shares(given: str | Mapping[str, float], what: str, example: str) -> dict[str, float]:
    """Read "alpha12=1.3,U31=-0.3", in percent, as shares; numbers in a mapping are shares."""
    return numbers(given, what, example, 100.0)


def damping_ratios(given: str | Sequence[float] | None) -> Sequence[float]:
    """Read "1,0.5", in percent, as damping ratios."""
    if not isinstance(given, str):
        return given or ()
    values = [number(part) for part in given.split(",")]
    if not all(0 <= value < 100 for value in values):
        raise ValueError(
            f"--damping {given!r}: percent of critical damping of the first modes, from 0 to below 100, 1,0.5"
        )
    return [value / 100 for value in values]
