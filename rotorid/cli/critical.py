"""`rotorid critical`: critical speeds and mode shapes."""

from __future__ import annotations

from typing import Annotated

import typer

from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    RotorArgument,
    check_targets,
    emit,
    picture,
)


def critical(
    rotor: RotorArgument,
    n: Annotated[int, typer.Option("-n", "--number", min=1, help="How many.")] = 3,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Critical speeds and mode shapes of a rotor.

    Example: rotorid critical sample_data/rotor23.csv -n 3 --plot modes.png
    """
    import fem
    from rotorid.tables import read_rotor, rotor_files

    check_targets(plot, output)
    modes = fem.critical_speeds(read_rotor(rotor), n)

    emit(
        modes.to_dict(),
        modes.summary,
        as_json=json,
        files=rotor_files(rotor),
        options={"number": n},
        figure=(plot, picture(modes.plot)),
        table=(output, modes.to_frame),
    )
