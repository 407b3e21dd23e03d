"""`campbell`: whirl frequencies, logarithmic decrements and damped critical speeds over speed."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, percent, rpm_text
from rotorid.commands.option_values import Band, Speeds, band, number, rising_speeds
from rotorid.report.options import rotor_of
from rotorid.report.outcome import USUAL, Outcome, command

if TYPE_CHECKING:
    from fem import Campbell, Rotor
    from rotorid.base.arrays import FloatArray


@dataclass(frozen=True)
class CampbellOptions:
    """Options of `campbell`.

    Attributes
    ----------
    speeds : SPEEDS
        FIRST:LAST:STEP or a list, rad/s; or with a unit: 500:15000:250rpm.
    number : -n N from 1
        How many modes, by default 6; forward and backward whirl count apart.
    operating : A:B
        Operating speeds, such as 5300:6500rpm.
    heavy : VALUE
        Logarithmic decrement above which a mode is heavily damped: others are listed before it, and it is
        drawn pale.
    mesh_check
        Estimate by elements cut in two how far off the mesh makes frequencies and critical speeds.
    cross_coupling : LEAST:MOST
        Stability over added cross-coupling, N/m, at the mid span, 0:5e7, or at a node or station, 0:5e7@12;
        at the highest operating speed, or else the last speed.
    """

    speeds: Speeds
    number: int | None = None
    operating: Band | None = None
    heavy: float = 6.0
    mesh_check: bool = False
    cross_coupling: str | tuple[float, float] | None = None
    to = USUAL
    panels: ClassVar[Mapping[str, str]] = {"Method": "heavy mesh_check cross_coupling"}


@command
def campbell(rotor: Rotor | Path | str, options: CampbellOptions) -> Outcome:
    """Whirl frequencies, decrements and directions over speed; damped critical speeds.

    The picture is a Campbell diagram with the 1× line, over the logarithmic decrements.

    Example: rotorid campbell sample_data/compressor/rotor.toml --speeds 1000:15000:250rpm --plot campbell.png

    Example: rotorid campbell sample_data/compressor/rotor.toml --speeds 1000:9000:250rpm
    --operating 5300:6500rpm --cross-coupling 0:1e7 --plot whirl.png

    Parameters
    ----------
    rotor : ROTOR
        Rotor table (.csv, .xlsx) or rotor file (.toml).
    options
        The speeds, and what differs from the defaults.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be.
    """
    import fem
    from fem.parameters import band as error_band
    from fem.parameters import nearest_modes
    from fem.plots import campbell_figure
    from rotorid.commands.operating_range import Separation, unsearched

    operating = band(options.operating)
    span, place = _span(options.cross_coupling)
    model = rotor_of(rotor)
    speeds = rising_speeds(options.speeds)
    solve = functools.partial(fem.campbell, speeds=speeds, n=options.number, heavy=options.heavy)
    whirl = solve(model)

    def frequencies(other: Rotor) -> FloatArray:
        return nearest_modes(whirl.frequencies, (whirl if other is model else solve(other)).frequencies)

    std, doubts = error_band(model, "the frequencies", frequencies)
    whirl = dataclasses.replace(whirl, std=std, warnings=(*whirl.warnings, *doubts))
    beside: dict[str, Any] = {}
    if operating:
        doubt = unsearched(speeds[0], speeds[-1], operating)
        doubt = doubt or ("the list may be cut, ask for more modes (-n)" if whirl.cut else "")
        peaks = [
            row["speed_rad_s"]
            for row in whirl.to_dict()["damped_critical_speeds"]
            if not row["heavily_damped"]
        ]
        beside["operating"] = Separation(peaks, operating, doubt)
    sentences = [*whirl.sentence().splitlines()]
    if span:
        from rotorid.commands.cross_coupling import cross_coupling

        at = operating[1] if operating else speeds[-1]
        beside["cross_coupling"] = cross_coupling(model, at, span, place)
    sentences += [part.sentence() for part in beside.values()]
    keys = {**whirl.to_dict(), **{key: part.to_dict() for key, part in beside.items()}}
    if options.mesh_check:
        changes = whirl.mesh_change()
        named = zip(("frequencies_change", "critical_speeds_change"), changes, strict=True)
        keys["mesh_check"] = plain(dict(named))
        sentences.append(
            f"Elements cut in two change frequencies by at most {percent(changes[0])} %, damped critical "
            f"speeds by at most {percent(changes[1])} %."
        )
    criticals, every = whirl.tables()
    return Outcome(
        result=whirl,
        sentences=tuple(sentences),
        tables=(criticals,) if whirl.critical_speeds.size else (),
        more=(
            *(table.under(key) for key, part in beside.items() for table in part.tables()),
            *(_at(whirl, s) for s in dict.fromkeys((0, len(speeds) - 1))),
        ),
        file=every,
        keys=keys,
        warnings=whirl.warnings,
        notes=(whirl.cut,) if whirl.cut else (),
        pictures={
            "Campbell diagram over the logarithmic decrements.": lambda: campbell_figure(whirl, operating)
        },
        title="Whirl",
    )


def _span(given: str | tuple[float, float] | None) -> tuple[tuple[float, float] | None, str | None]:
    """Read "0:5e7" or "0:5e7@impeller 3" as a range, N/m, and the place; None: nowhere said."""
    if given is None:
        return None, None
    text, _, place = given.partition("@") if isinstance(given, str) else ("", "", "")
    ends = [number(part) for part in text.split(":")] if isinstance(given, str) else given
    if len(ends) != 2 or not 0 <= ends[0] < ends[1]:
        raise ValueError(f"--cross-coupling {given!r} is not a range: use LEAST:MOST, such as 0:5e7")
    return (ends[0], ends[1]), place.strip() or None


def _at(whirl: Campbell, s: int) -> Table:
    """Whirl at one of the speeds."""
    ways = [mode[s] or "none" for mode in whirl.to_dict()["direction"]]
    place = f"frequencies_rad_s.*.{s}"
    columns = (
        Column("mode", range(1, len(ways) + 1)),
        Column("whirl", ways),
        Column("rpm", whirl.frequencies[s] * RPM, "{:.2f}".format, place, RPM),
        Column("rad/s", whirl.frequencies[s], "{:.4f}".format, place),
        Column("log dec", whirl.log_decrements[s], "{:z.4f}".format, f"log_decrements.*.{s}"),
    )
    return Table(f"whirl at {rpm_text(whirl.speeds[s])}", columns)
