"""`rotorid demo`: the main job on sample data."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.cli.common import JsonOption, picture, provenance, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

JOB = "turbo_job"
ROTOR = "rotor23.csv"
NODES, MODES = (7, 12, 18), 2


def demo(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="Where to write the sample job.")] = Path(
        "rotorid-demo"
    ),
    json: JsonOption = False,
) -> None:
    """Write the sample job to DIR, run the main job on it, and say where the pictures are.

    Example: rotorid demo demo
    """
    import fem
    from balancing import correct, estimate_influence
    from balancing.plots import overview
    from rotorid.reduction import reduce
    from rotorid.samples import sample_data
    from rotorid.tables import read_job, read_rotor

    samples = sample_data()
    (folder / JOB).mkdir(parents=True, exist_ok=True)
    job_files = [f for f in sorted((samples / JOB).iterdir()) if f.suffix in (".csv", ".toml", ".md")]
    for source in (samples / ROTOR, *job_files):
        shutil.copyfile(source, folder / source.relative_to(samples))

    rotor = read_rotor(folder / ROTOR)
    modes = fem.critical_speeds(rotor, 3)
    small = reduce(rotor, NODES, MODES)
    job = read_job(folder / JOB / "job.toml")
    correction = correct(estimate_influence(job.trials))
    pictures: dict[str, Callable[[], Figure]] = {
        "modes.png": picture(modes.plot),
        "reduction.png": picture(small.plot),
        "balance.png": lambda: overview(correction),
    }
    for name, build in pictures.items():
        save_figure(build(), folder / name)

    if json:
        import json as json_module

        document = {
            "folder": str(folder),
            "pictures": [str(folder / name) for name in pictures],
            "critical": modes.to_dict(),
            "reduce": small.to_dict(),
            "balance": correction.to_dict(),
            "provenance": provenance([folder / ROTOR, *job.files], {"folder": folder}),
        }
        typer.echo(json_module.dumps(document, ensure_ascii=False, allow_nan=False, indent=1))
        return
    blocks = [
        f"1. Critical speeds: rotorid critical {folder / ROTOR}",
        modes.summary(),
        f"2. Balancing: rotorid balance {folder / JOB / 'job.toml'}",
        correction.summary(),
        f"3. Reduction: rotorid reduce {folder / ROTOR} --nodes {','.join(map(str, NODES))} --modes {MODES}",
        small.summary(),
        "Pictures:\n" + "\n".join(f"  {folder / name}" for name in pictures),
    ]
    typer.echo("\n\n".join(blocks))
