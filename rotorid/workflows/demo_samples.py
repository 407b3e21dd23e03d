"""The samples of `rotorid demo`: which files they need, and which commands show what they are good for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """One command of a sample.

    Attributes
    ----------
    key
        Under which its result stands in the JSON document.
    title
        What it does, in a few words.
    arguments
        As typed after `rotorid`; `{}` is the folder of the demo.
    """

    key: str
    title: str
    arguments: tuple[str, ...]


@dataclass(frozen=True)
class Sample:
    """Files to copy and commands to run on them.

    Attributes
    ----------
    about
        One line for the list.
    sources
        Files and folders of the sample data; of folders all tables, model, job and
        explaining files, and licenses.
    steps
        What is run, in order.
    pictures
        What the commands write, file names within the folder of the demo.
    """

    about: str
    sources: tuple[str, ...]
    steps: tuple[Step, ...]
    pictures: tuple[str, ...]


SPEEDS = "1000:15000:250rpm"
TURBO, COMPRESSOR, ROTOR = "{}/turbo_job", "{}/compressor", "{}/rotor23.csv"
TASK_5_1, TASK_4_1 = "{}/identify/task_5_1", "{}/identify/task_4_1"
RUN_DOWN = "{}/fit/run_down"

SAMPLES = {
    "main": Sample(
        "critical speeds, correction weights and three masses of one rotor",
        ("rotor23.csv", "turbo_job"),
        (
            Step("critical", "Critical speeds", ("critical", ROTOR, "--plot", "{}/modes.png")),
            Step("balance", "Balancing", ("balance", f"{TURBO}/job.toml", "--plot", "{}/balance.png")),
            Step(
                "reduce",
                "Reduction",
                ("reduce", ROTOR, "--nodes", "7,12,18", "--modes", "2", "--plot", "{}/reduction.png"),
            ),
        ),
        ("modes.png", "reduction.png", "balance.png"),
    ),
    "balancing": Sample(
        "trial runs to weights, the smallest largest amplitude, a check run and the trim after it",
        ("turbo_job",),
        (
            Step("balance", "Weights", ("balance", f"{TURBO}/job.toml", "--plot", "{}/balance.png")),
            Step(
                "minmax",
                "The smallest largest amplitude, with at most 430 g·mm in each plane",
                ("balance", f"{TURBO}/job.toml", "--method", "minmax", "--max-mass", "430g_mm"),
            ),
            Step("check", "The check run beside its prediction", ("balance", f"{TURBO}/checked.toml")),
            Step(
                "trim",
                "Trim: coefficients refined by the check run",
                ("balance", f"{TURBO}/checked.toml", "--refine", "--plot", "{}/trim.png"),
            ),
        ),
        ("balance.png", "trim.png"),
    ),
    "holes": Sample(
        "weights as pieces in the holes of three discs, and one weight split by hand",
        ("turbo_job",),
        (
            Step(
                "balance",
                "Pieces in holes, all planes together",
                ("balance", f"{TURBO}/holes.toml", "--split", "--plot", "{}/discs.png"),
            ),
            Step(
                "split",
                "One weight on one disc",
                ("split", "35g@120", "--holes", "24", "--pieces", "10g,20g"),
            ),
        ),
        ("discs.png",),
    ),
    "rig": Sample(
        "a real rig: eleven runs with known weights, each read three times",
        ("rk4",),
        (Step("balance", "Weights", ("balance", "{}/rk4/job.toml", "--plot", "{}/balance.png")),),
        ("balance.png",),
    ),
    "rotor": Sample(
        "a compressor: critical speeds, Campbell diagram, response with margins",
        ("compressor",),
        (
            Step(
                "critical",
                "Critical speeds beside the operating range",
                (
                    *("critical", f"{COMPRESSOR}/rotor.toml", "-n", "4"),
                    *("--operating", "5300:6500rpm", "--plot", "{}/modes.png"),
                ),
            ),
            Step(
                "campbell",
                "Campbell diagram",
                (
                    *("campbell", f"{COMPRESSOR}/rotor.toml", "--speeds", SPEEDS),
                    *("--plot", "{}/campbell.png"),
                ),
            ),
            Step(
                "response",
                "Response to unbalance",
                (
                    *("response", f"{COMPRESSOR}/rotor.toml", "--unbalance", f"{COMPRESSOR}/unbalance.csv"),
                    *("--speeds", SPEEDS, "--sensors", "probe DE:45,probe NDE:45"),
                    *("--operating", "5300:6500rpm", "--plot", "{}/bode.png"),
                ),
            ),
        ),
        ("modes.png", "campbell.png", "bode.png"),
    ),
    "reduction": Sample(
        "a rotor as three masses: which nodes, beside other methods, and as a model file",
        ("rotor23.csv",),
        (
            Step(
                "rank",
                "All places of three masses, ranked",
                ("reduce", ROTOR, "--rank", "--plot", "{}/map.png"),
            ),
            Step(
                "reduce",
                "The book's places, beside Guyan, IRS and SEREP",
                (
                    *("reduce", ROTOR, "--nodes", "7,12,18", "--modes", "2", "--methods"),
                    *("--model", "{}/three_masses.toml", "--plot", "{}/reduction.png"),
                ),
            ),
        ),
        ("map.png", "reduction.png"),
    ),
    "identification": Sample(
        "coefficients from harmonic tests, and data that cannot tell all of them",
        ("identify/task_5_1", "identify/task_4_1"),
        (
            Step(
                "determined",
                "Stiffness and damping of one mass",
                ("identify", f"{TASK_5_1}/model.toml", f"{TASK_5_1}/data.csv", "--plot", "{}/identify.png"),
            ),
            Step(
                "undetermined",
                "Three unknowns, of which the data tell two",
                (
                    *("identify", f"{TASK_4_1}/model.toml", f"{TASK_4_1}/data.csv"),
                    *("--method", "output-error", "--amplitude-error", "2", "--phase-error", "1"),
                ),
            ),
        ),
        ("identify.png",),
    ),
    "record": Sample(
        "dampers and a mass of a rotor from its decay after a blow",
        ("fit/run_down",),
        (
            Step(
                "fit",
                "Parameters of a model from a record",
                (
                    *("fit", f"{RUN_DOWN}/model.toml", f"{RUN_DOWN}/record.csv"),
                    *("--plot", "{}/run_down.png"),
                ),
            ),
        ),
        ("run_down.png",),
    ),
}
