"""The samples of `rotorid demo`: which files they need, and which commands show what they are good for."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path


@dataclass(frozen=True)
class Step:
    """One command of a sample.

    Attributes
    ----------
    key
        Under which its result stands in the JSON document.
    title
        What it does, in a few words.
    line
        As typed after `rotorid`; `{}` is the folder of the demo.
    """

    key: str
    title: str
    line: str

    def command(self, folder: Path | str) -> list[str]:
        """Its words for a folder, `rotorid` first."""
        return ["rotorid", *(word.replace("{}", str(folder), 1) for word in shlex.split(self.line))]


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
    """

    about: str
    sources: tuple[str, ...]
    steps: tuple[Step, ...]

    @property
    def pictures(self) -> list[str]:
        """What the commands draw, file names within the folder of the demo."""
        words = [word for step in self.steps for word in step.command("")]
        return [file.strip("/") for option, file in pairwise(words) if option == "--plot"]


SAMPLES = {
    "main": Sample(
        "critical speeds, correction weights and three masses of one rotor",
        ("rotor23.csv", "turbo_job"),
        (
            Step("critical", "Critical speeds", "critical {}/rotor23.csv --plot {}/modes.png"),
            Step("balance", "Balancing", "balance {}/turbo_job/job.toml --plot {}/balance.png"),
            Step(
                "reduce",
                "Reduction",
                "reduce {}/rotor23.csv --nodes 7,12,18 --modes 2 --plot {}/reduction.png",
            ),
        ),
    ),
    "balancing": Sample(
        "trial runs to weights, the smallest largest amplitude, a check run and its trim",
        ("turbo_job",),
        (
            Step("balance", "Weights", "balance {}/turbo_job/job.toml --plot {}/balance.png"),
            Step(
                "minmax",
                "The smallest largest amplitude, with at most 430 g·mm in each plane",
                "balance {}/turbo_job/job.toml --method minmax --max-mass 430g_mm",
            ),
            Step("check", "The check run beside its prediction", "balance {}/turbo_job/checked.toml"),
            Step(
                "trim",
                "Trim: coefficients refined by the check run",
                "balance {}/turbo_job/checked.toml --refine --plot {}/trim.png",
            ),
        ),
    ),
    "holes": Sample(
        "weights as pieces in the holes of three discs, and one weight split by hand",
        ("turbo_job",),
        (
            Step(
                "balance",
                "Pieces in holes, all planes together",
                "balance {}/turbo_job/holes.toml --split --plot {}/discs.png",
            ),
            Step("split", "One weight on one disc", "split 35g@120 --holes 24 --pieces 10g,20g"),
        ),
    ),
    "rig": Sample(
        "a real rig: eleven runs with known weights, each read three times",
        ("rk4",),
        (Step("balance", "Weights", "balance {}/rk4/job.toml --plot {}/balance.png"),),
    ),
    "rotor": Sample(
        "a compressor: critical speeds, Campbell diagram, response with margins",
        ("compressor",),
        (
            Step(
                "critical",
                "Critical speeds beside the operating range",
                "critical {}/compressor/rotor.toml -n 4 --operating 5300:6500rpm --plot {}/modes.png",
            ),
            Step(
                "campbell",
                "Campbell diagram",
                "campbell {}/compressor/rotor.toml --speeds 1000:15000:250rpm --plot {}/campbell.png",
            ),
            Step(
                "response",
                "Response to unbalance",
                "response {}/compressor/rotor.toml --unbalance {}/compressor/unbalance.csv "
                "--speeds 1000:15000:250rpm --sensors 'probe DE:45,probe NDE:45' --operating "
                "5300:6500rpm --plot {}/bode.png",
            ),
        ),
    ),
    "reduction": Sample(
        "a rotor as three masses: which nodes, beside other methods, and as a model file",
        ("rotor23.csv",),
        (
            Step(
                "rank", "All places of three masses, ranked", "reduce {}/rotor23.csv --rank --plot {}/map.png"
            ),
            Step(
                "reduce",
                "The book's places, beside Guyan and IRS",
                "reduce {}/rotor23.csv --nodes 7,12,18 --modes 2 --methods --model "
                "{}/three_masses.toml --plot {}/reduction.png",
            ),
        ),
    ),
    "identification": Sample(
        "coefficients from harmonic tests, and data that cannot tell all of them",
        ("identify/task_5_1", "identify/task_4_1"),
        (
            Step(
                "determined",
                "Stiffness and damping of one mass",
                "identify {}/identify/task_5_1/model.toml {}/identify/task_5_1/data.csv --plot "
                "{}/identify.png",
            ),
            Step(
                "undetermined",
                "Three unknowns, of which the data tell two",
                "identify {}/identify/task_4_1/model.toml {}/identify/task_4_1/data.csv "
                "--amplitude-error 2 --phase-error 1",
            ),
        ),
    ),
    "record": Sample(
        "dampers and a mass of a rotor from its decay after a blow",
        ("fit/run_down",),
        (
            Step(
                "fit",
                "Parameters of a model from a record",
                "fit {}/fit/run_down/model.toml {}/fit/run_down/record.csv --plot {}/run_down.png",
            ),
        ),
    ),
    "waveforms": Sample(
        "two planes from the waveforms of three runs, a run-up beside them",
        ("waveforms",),
        (
            Step(
                "vectors",
                "1× of each run, and the tacho",
                "vectors {}/waveforms/waveforms.toml --plot {}/tacho.png",
            ),
            Step(
                "balance", "Weights from the records", "balance {}/waveforms/job.toml --plot {}/balance.png"
            ),
        ),
    ),
    "calibration": Sample(
        "bearings of a compressor from one trial run, then weights without one",
        ("compressor", "calibration"),
        (
            Step(
                "calibrate",
                "Bearings from a run with two weights",
                "calibrate {}/compressor/rotor.toml {}/calibration/trial.toml --estimate 'bearing[*].*' "
                "--prior 'bearing[*].*=20%' --plot {}/calibration.png",
            ),
            Step(
                "balance",
                "Another day: one run, no trial weight",
                "balance {}/calibration/later.toml --plot {}/balance.png",
            ),
        ),
    ),
}
