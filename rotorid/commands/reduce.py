"""`reduce`: a rotor as a few masses, how good they are, and the small model to go on with."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from rotorid.base.answer import Answer, together
from rotorid.base.text import counted, listing
from rotorid.commands.option_values import (
    Band,
    Nodes,
    Speeds,
    band,
    nodes,
    number,
    numbers,
    one_of,
    one_speed,
    rising_speeds,
)
from rotorid.report.options import refuse, rotor_of
from rotorid.report.outcome import (
    EQUATIONS,
    WITH_REPORT,
    Outcome,
    command,
    outcome_of,
    table_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fem import Rotor
    from rotorid.files.node_tables import MeasuredModes
    from rotorid.reduction import InputErrors, Placement, Reduction, SmallModel
    from rotorid.report.outcome import Written

Place = Literal["best", "compromise", "mac", "book"]
"""Which of all places of the masses is taken."""
Rows = Literal["equal", "relative"]
"""How rows of the regression are weighted."""
STATE_SPACE = (".json", ".npz", ".mat")
ERRORS = ("compliance", "frequencies", "shapes", "seal_stiffness")


@dataclass(frozen=True)
class ReduceOptions:
    """Options of `reduce`.

    Attributes
    ----------
    nodes : LIST
        Where the masses stand: nodes or stations, 7,12,18.
    place
        Instead of nodes: all places are ranked, and the best by frequency, the best by MAC or a compromise
        taken; or those of the book's rule (extrema of the first two modes).
    masses : N from 1
        How many masses are placed; default: 3.
    candidates : LIST
        Nodes that places are chosen from.
    modes : N from 1
        How many modes the regression uses; default: 2.
    rows
        Rows of the regression as they stand (the book: the first mode dominates), or of each mode relative
        to its 1/ω².
    nonnegative
        No mass below 0.
    measured : FILE
        Table of measured modes (mode, frequency_rad_s, node, shape), used instead of computed ones.
    compliance : FILE
        Without a rotor, with measured modes: table node, force_node, compliance_m_per_N.
    seals : LIST
        With a table of compliance: springs to the ground that it does not hold, N/m, 12=2e6.
    errors : LIST
        Standard deviations of the inputs in percent: compliance=1.3,shapes=1,frequencies=0.1.
    supports_apart
        Compliance of the shaft and its two bearings apart, (47).
    damping : LIST
        Modal damping of the small model, percent of critical of the first modes: 1,0.5.
    speed : SPEED
        Of tables of bearings and seals, and of the small model, such as 3000rpm; default: the lowest of the
        tables.
    methods
        Beside other reductions.
    response : A:B:STEP
        Unbalance response beside the full rotor's, at speeds in rad/s or with a unit; or auto.
    stability : A:B
        Stability beside the full rotor's, 0:9000rpm.
    force : LIST
        Nodes of measured forces, inputs f_x12 of the small model that --output writes, 12 or 7,12.
    keep_supports
        For motion: masses of the shaft alone, estimated with rigid bearings in place of bearings and films;
        all supports and forces stay in the model, at nodes of their own.
    """

    nodes: Nodes | None = None
    place: Place | None = None
    masses: int | None = None
    candidates: Nodes | None = None
    modes: int | None = None
    rows: Rows = "equal"
    nonnegative: bool = False
    measured: Path | str | None = None
    compliance: Path | str | None = None
    seals: str | Mapping[str, float] | None = None
    errors: str | Mapping[str, float] | None = None
    supports_apart: bool = False
    damping: str | Sequence[float] | None = None
    speed: str | float | None = None
    methods: bool = False
    response: Speeds | None = None
    stability: Band | None = None
    force: Nodes | None = None
    keep_supports: bool = False
    panels: ClassVar[Mapping[str, str]] = {
        "Input": "nodes modes speed measured compliance seals",
        "Method": "place masses candidates methods errors",
        "Small model": "response stability damping force keep_supports",
        "Expert": "rows nonnegative supports_apart",
    }
    to = (*WITH_REPORT, *EQUATIONS)
    outputs = (".csv", ".xlsx", ".toml", *STATE_SPACE)


@command
def reduce(rotor: Rotor | Path | str | None = None, options: ReduceOptions | None = None) -> Outcome:
    """A rotor as a few masses at chosen nodes (formula 50), and how good they are.

    The formula is one of a plane at rest; bearings, seals, gyroscopic effect and damping come back with the
    small model: --output FILE.toml writes it for motion, periodic, bearings, and for fit, identify and
    simulate, with a damper to be estimated at each mass; .json, .npz or .mat A, B, C, D in both planes. With
    --keep-supports bearings, films and other forces stay apart from the masses, for motion.

    Example: rotorid reduce sample_data/rotor23.csv --nodes 7,12,18 --modes 2

    Example: rotorid reduce sample_data/rotor23.csv --place compromise --plot map.png

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
    options = options or ReduceOptions()
    _check_used(options, rotor is not None)
    if rotor is None:
        return _outcome({"": _of_tables(options)}, options, "")
    return _outcome(
        _of_rotor(rotor, options), options, Path(rotor).name if isinstance(rotor, Path | str) else ""
    )


def _outcome(parts: Mapping[str, Any], options: ReduceOptions, name: str) -> Outcome:
    """The masses, and what was asked for beside them, by their keys in the document; the ranking first."""
    result = parts[""]
    small: SmallModel | None = parts.get("small_model")
    placement = parts.get("placement")
    force = [] if options.force is None else nodes(options.force, "--force")
    forces = force if result.rotor is None else [result.rotor.node(node) for node in force]
    speed = _speed(result.rotor, options)
    first = [] if placement is None else [placement.answer]
    if options.keep_supports and result.rotor is not None:
        at = listing((str(support.node) for support in result.rotor.supports), "and")
        first.append(Answer(f"The shaft held rigidly at nodes {at}, without its supports and forces:"))
    rest = [part.answer for part in parts.values() if part is not placement and part is not small]
    if small is not None:
        words = small.answer
        rest.append(Answer("", "", words.warnings, tables=(words.judgement,), more="the small model"))

    def model(path: Path) -> Written:
        from rotorid.commands.reduce_result import model_files, small_of

        kept, model = options.keep_supports, small or small_of(result)
        return model_files(path, result, model, speed, name, keeps_supports=kept, forces=forces)

    def state_space(path: Path) -> Written:
        from rotorid.commands.reduce_result import small_of, state_space_bytes

        if options.keep_supports:
            raise ValueError(f"{path}: with --keep-supports the small model is for motion: FILE.toml")
        return state_space_bytes(small or small_of(result), speed, path.suffix.lower())

    keys: dict[str, Any] = {key: part.to_dict() for key, part in parts.items()}
    return outcome_of(
        result,
        answer=together([*first, *rest]),
        keys={**keys.pop(""), **keys},
        file=lambda: table_of((placement or result).to_frame()),
        files={".toml": model, **dict.fromkeys(STATE_SPACE, state_space)},
        pictures={
            caption: partial(_picture, parts[key]) for key, caption in _CAPTIONS.items() if key in parts
        },
        title=f"Rotor reduced to {counted(len(result.nodes), 'mass', 'masses')}",
        solved=result,
    )


_CAPTIONS = {
    "stability": "Smallest logarithmic decrement over speed; below 0 a motion grows.",
    "methods": "What each method loses: errors of frequencies.",
    "placement": "All ranked choices: largest error of a frequency over the largest 1 - MAC.",
    "": "Mode shapes of the small model over those it was made from.",
}
"""Of pictures by what was asked for, the last first."""


def _picture(part: Any) -> Figure:  # noqa: ANN401 - one of the results
    from rotorid.base.plot_style import on_figure
    from rotorid.plots import plot

    return on_figure(lambda ax: plot(part, ax), height=5.0)


def _speed(rotor: Rotor | None, options: ReduceOptions) -> float:
    """Of the small model, rad/s."""
    if options.speed is not None:
        return one_speed(options.speed, "--speed")
    tables = [] if rotor is None else [support.speeds[0] for support in rotor.supports if support.speeds]
    return max(tables, default=0.0)


def _check_used(options: ReduceOptions, has_rotor: bool) -> None:
    """Refuse options that would have no effect."""
    computed = ("place", "methods", "response", "stability")
    if has_rotor:
        refuse(options, ("compliance", "seals"), "takes the place of a rotor: give it, or ROTOR, not both")
    else:
        others = ("candidates", "speed", "supports_apart", "damping", "keep_supports")
        refuse(options, (*computed, *others), "needs a rotor: give ROTOR instead of --compliance")
    if options.place is None:
        refuse(options, ("masses", "candidates"), "does nothing without --place")
    if options.keep_supports:
        on_supports = ("measured", "supports_apart", "speed", "response", "stability", "force")
        rigid = "asks for the rotor on its supports; with --keep-supports the masses are found on rigid ones"
        refuse(options, on_supports, rigid)
    if options.measured is not None:
        refuse(options, computed, "compares with the computed rotor, not with the measured modes")


def _of_rotor(rotor: Rotor | Path | str, options: ReduceOptions) -> dict[str, Any]:
    """The masses of a rotor, and what is asked for beside them."""
    from rotorid.commands.reduce_result import small_of
    from rotorid.files.node_tables import read_modes
    from rotorid.reduction import (
        check_free,
        compare_methods,
        compare_response,
        compare_stability,
        held_nodes,
        held_rigidly,
        keep_supports,
    )
    from rotorid.reduction import reduce as reduce_rotor

    whole = rotor_of(rotor)
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
        data = modes_at(data, machine, places, options.measured)
    result = reduce_rotor(
        machine,
        places,
        used,
        speed=at,
        supports_apart=options.supports_apart,
        measured=None if data is None else (data.frequencies, data.shapes),
        rows=options.rows,
        nonnegative=options.nonnegative,
        errors=input_errors(options.errors, data, used),
    )
    parts: dict[str, Any] = {"": result}
    if placement is not None:
        parts["placement"] = placement
    if options.methods:
        parts["methods"] = compare_methods(result)
    stable = band(options.stability, "--stability")
    small, ratios = None, _damping_ratios(options.damping)
    if options.keep_supports:
        small = keep_supports(whole, places, result.masses.solution, modal_damping=ratios)
    elif options.response is not None or stable is not None or ratios:
        small = small_of(result, ratios)
    if options.response is not None and small is not None:
        automatic = str(options.response) == "auto"
        speeds = None if automatic else rising_speeds(options.response, "--response")
        parts["response"] = compare_response(machine, small, speeds)
    if stable is not None and small is not None:
        parts["stability"] = compare_stability(machine, small, stable[1], lowest=stable[0])
    return parts | ({} if small is None else {"small_model": small})


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
    if options.place not in (None, "book"):
        candidates: Sequence[int | str] = [n for n in range(1, rotor.n_nodes + 1) if n not in held]
        placement = rank_nodes(
            rotor,
            masses,
            min(2, masses) if options.modes is None else options.modes,
            candidates=candidates
            if options.candidates is None
            else nodes(options.candidates, "--candidates"),
            speed=speed,
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
    raise ValueError("say where the masses stand: --nodes 7,12,18, or --place best, compromise, mac or book")


def _of_tables(options: ReduceOptions) -> Reduction:
    """A reduction without a rotor: its compliance and its modes from tables."""
    from rotorid.files.node_tables import read_compliance, read_modes
    from rotorid.reduction import reduce_measured

    if options.compliance is None or options.measured is None:
        raise ValueError("give a rotor, or --compliance and --measured, which take its place")
    data = read_modes(options.measured)
    named: dict[str, Any] = {str(node): node for node in data.nodes}
    asked = data.nodes if options.nodes is None else nodes(options.nodes, "--nodes")
    wanted = [named.get(str(node), node) for node in asked]
    data = modes_at(data, None, wanted, options.measured)
    given_nodes, alpha = read_compliance(options.compliance, wanted)
    order = [given_nodes.index(node) for node in wanted]
    used = min(2, len(data.frequencies), len(wanted)) if options.modes is None else options.modes
    springs = {str(node): k for node, k in numbers(options.seals or {}, "--seals", "12=2e6").items()}
    if lost := springs.keys() - {*map(str, wanted)}:
        raise ValueError(f"--seals: no mass stands at {min(lost)!r}")
    return reduce_measured(
        alpha[order][:, order],
        data.frequencies,
        data.shapes,
        used,
        nodes=wanted,
        seal_stiffness=[springs.get(str(node), 0.0) for node in wanted],
        rows=options.rows,
        nonnegative=options.nonnegative,
        errors=input_errors(options.errors, data, used),
    )


def modes_at(data: MeasuredModes, rotor: Rotor | None, wanted: list[Any], path: Path | str) -> MeasuredModes:
    """The measured modes at these places only, in their order."""
    measured = [rotor.node(node) for node in data.nodes] if rotor is not None else list(data.nodes)
    lost = [str(node) for node in wanted if node not in measured]
    if lost:
        raise ValueError(
            f"{path}: no shape was measured at {', '.join(lost)}; there are {', '.join(map(str, measured))}"
        )
    rows = [measured.index(node) for node in wanted]
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
    for name, value in numbers(given or {}, "--errors", "compliance=1.3,shapes=1", 100.0).items():
        if not 0 <= value < 1:
            raise ValueError(
                f"--errors: {name}={100 * value:g} is no standard deviation from 0 to 100 percent"
            )
        stated[one_of(name, "--errors", ERRORS)] = value
    return InputErrors(**stated) if stated else None


def _damping_ratios(given: str | Sequence[float] | None) -> Sequence[float]:
    """Read "1,0.5", in percent, as damping ratios."""
    if not isinstance(given, str):
        return given or ()
    values = [number(part) for part in given.split(",")]
    if not all(0 <= value < 100 for value in values):
        raise ValueError(
            f"--damping {given!r}: percent of critical damping of the first modes, from 0 to below 100, 1,0.5"
        )
    return [value / 100 for value in values]
