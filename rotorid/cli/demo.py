"""`rotorid demo`: the main job on sample data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.cli.common import JsonOption, figure_bytes, picture, provenance

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
    from rotorid.tables.writing import write_files

    samples = sample_data()
    job_files = [f for f in sorted((samples / JOB).iterdir()) if f.suffix in (".csv", ".toml", ".md")]
    copies = {folder / f.relative_to(samples): f.read_bytes() for f in (samples / ROTOR, *job_files)}
    _check_folder(folder, samples, copies)
    (folder / JOB).mkdir(parents=True, exist_ok=True)
    write_files({path: data for path, data in copies.items() if not path.exists()})

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
    write_files({folder / name: figure_bytes(build(), folder / name) for name, build in pictures.items()})

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


def _check_folder(folder: Path, samples: Path, copies: Mapping[Path, bytes]) -> None:
    """Refuse a folder whose files the demo would overwrite."""
    remedy = "choose another folder: rotorid demo DIR"
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: this is a file; {remedy}")
    inside = folder.resolve()
    if (
        samples.resolve() in (inside, *inside.parents)
        or (folder / JOB).resolve() == (samples / JOB).resolve()
    ):
        raise ValueError(f"{folder}: these are the sample data themselves; {remedy}")
    changed = [str(p) for p, data in copies.items() if p.exists() and (p.is_dir() or p.read_bytes() != data)]
    if changed:
        raise ValueError(
            f"{', '.join(changed)}: differs from the sample and would be overwritten; delete it, or {remedy}"
        )
