"""The pictures of the documentation: what commands draw from the sample data, and what each lets one read."""

from __future__ import annotations

import contextlib
import functools
import io
import os
import re
import shlex
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

ROOT = Path(__file__).parents[1]
COMPRESSOR = "sample_data/compressor/rotor.toml"
TURBO, MODEL_JOB = "sample_data/turbo_job", "sample_data/model_job/job.toml"
IDENTIFY, FIT = "sample_data/identify", "sample_data/fit"
PROBES = "--sensors 'probe DE:45,probe NDE:45'"
RESPONSE = (
    f"response {COMPRESSOR} --unbalance sample_data/compressor/unbalance.csv "
    f"--speeds 1000:15000:100rpm {PROBES}"
)
MOTION = "sample_data/motion"
RUN_UP = "sample_data/waveforms/run_up.wav --tacho 1 --unit um --phase lag"
THREE = "reduce sample_data/rotor23.csv --nodes 7,12,18"
PNG_DOTS = 150
"""Dots an inch of a .png."""


@dataclass(frozen=True)
class Picture:
    """One picture.

    Attributes
    ----------
    name, group
        Of the picture, and where in the gallery it stands.
    command
        Without `rotorid` and `--plot`.
    read
        The sentence that it lets one read.
    dense
        Of so many points that pixels are smaller than lines.
    first
        A command before it.
    """

    name: str
    group: str
    command: str
    read: str
    dense: bool = False
    first: str = ""

    @property
    def typed(self) -> str:
        """The commands as a reader types them, in any shell."""
        before = f"rotorid {self.first}\n" if self.first else ""
        return f"{before}rotorid {self.command} --plot {self.name}.png".replace("'", '"')

    @property
    def kind(self) -> str:
        """How it is drawn, svg or png."""
        return "png" if self.dense else "svg"


GALLERY = (
    Picture(
        "balance",
        "balancing",
        f"balance {TURBO}/job.toml",
        "Mount 423 g·mm at 169° on the left plane, 304 at 278° on the middle and 448 at 12° on the "
        "right one: the worst probe shows 60 µm pp now and about 2 at most then.",
    ),
    Picture(
        "checked",
        "balancing",
        f"balance {TURBO}/checked.toml",
        "The check run shows what was predicted: every star lies within its bar, and an rms of 28.4 "
        "µm pp has become 0.4.",
    ),
    Picture(
        "discs",
        "balancing",
        f"balance {TURBO}/holes.toml --split",
        "Six pieces and their holes, seen from the end from which the rotor turns counter-clockwise: the "
        "fewest that leave less than a fifth of the vibration, though what they make in each plane (bold) is "
        "far from the weights that would leave least (dashed).",
    ),
    Picture(
        "grade",
        "balancing",
        f"balance {TURBO}/checked.toml --planes left,right --grade G6.3 --rotor-mass 558kg "
        "--service-speed 4500rpm",
        "In both planes more than 600 times less unbalance is left than G6.3 permits: pass.",
    ),
    Picture(
        "tolerance",
        "balancing",
        "tolerance --mass 500kg --speed 3000rpm --grade G2.5 --planes left=100mm,right=600mm "
        "--bearings 0mm,700mm --centre 320mm",
        "G2.5 allows this rotor 3979 g·mm, 2228 of it in the left plane and 1751 in the right one.",
    ),
    Picture(
        "trial-weight",
        "balancing",
        f"trial-weight {MODEL_JOB} --plane middle",
        "Begin in the middle plane with 408 g·mm at 234° from the mark, with the rotation.",
    ),
    Picture(
        "split",
        "balancing",
        "split 35g@120 --holes 24 --pieces 10g,20g --taken 3:10g --per-hole 2",
        "20 g in hole 7 and in hole 11 of the 24 make the wanted 35 g at 120° but for 1 %; hole 3 has a "
        "piece already.",
    ),
    Picture(
        "drill",
        "balancing",
        "split 3g@120 --drill 8mm --radius 100mm",
        "Drill a hole of 8 mm, 9.5 mm deep, opposite the 3 g that are missing at 120°.",
    ),
    Picture(
        "unbalance",
        "balancing",
        f"unbalance {MODEL_JOB} --stations 6,12,19",
        "Where the unbalance sits, how large and in which direction; the closed line at the tip of "
        "each is the region where it lies with 95 %.",
    ),
    Picture(
        "type",
        "balancing",
        "fleet fit sample_data/fleet",
        "Coefficients of six fans over those of their type, with regions of 95 of 100 machines; 132-07 was "
        "written down with lag for lead.",
    ),
    Picture(
        "modes",
        "rotors",
        "critical sample_data/rotor23.csv -n 3",
        "At the first critical speed, 1291 rpm, the middle swings most; at the second, 5164 rpm, both"
        " halves swing against each other about a node 1.7 m from the end.",
    ),
    Picture(
        "map",
        "rotors",
        f"critical {COMPRESSOR} -n 3 --map",
        "At the stiffness of the bearings, about 10⁸ N/m, stiffer supports would raise the "
        "first critical speed little, the second and the third much more.",
    ),
    Picture(
        "campbell",
        "rotors",
        f"campbell {COMPRESSOR} --speeds 1000:15000:500rpm",
        "Where the line 1× meets a mode, unbalance excites it; the decrement of mode 2 falls below "
        "zero at about 11 000 rpm: the rotor is unstable above.",
    ),
    Picture(
        "response",
        "rotors",
        f"{RESPONSE} --operating 5300:6500rpm",
        "Both probes peak near 4400, 8330 and 10 700 rpm, not in the operating range; beyond 10 932 "
        "rpm there is no steady state.",
    ),
    Picture(
        "polar",
        "rotors",
        f"{RESPONSE} --view polar",
        "Each loop is a critical speed: while the speed passes it, the phase turns by half a circle.",
    ),
    Picture(
        "orbits",
        "rotors",
        f"response {COMPRESSOR} --unbalance sample_data/compressor/unbalance.csv --speeds 5000rpm {PROBES} "
        "--view orbits",
        "At 5000 rpm, a stable speed, both ends run forward on nearly round orbits, the non-drive end"
        " on the larger one.",
    ),
    Picture(
        "influence",
        "rotors",
        f"influence {COMPRESSOR} --planes 'impeller 1,impeller 5' {PROBES} --speeds 1000:15000:100rpm",
        "How many µm a g·mm in each plane moves each probe, at every speed: impeller 1 hardly moves "
        "the probe DE near 5500 rpm.",
    ),
    Picture(
        "study",
        "rotors",
        "study sample_data/study/study.toml --samples 300",
        "One of seven drawn rotors meets 15 µm as built, all of them after three corrections or fewer; "
        "the worst reads 3.5 times the limit as built.",
    ),
    Picture(
        "reduction",
        "reduction",
        f"{THREE} --modes 2",
        "Three masses of 134, 197 and 157 kg at nodes 7, 12 and 18 have the first two modes of the "
        "rotor; the third is 8 % too low.",
    ),
    Picture(
        "places",
        "reduction",
        "reduce sample_data/rotor23.csv --place compromise",
        "Few of the 2024 choices of three nodes have both good frequencies and good shapes: the line "
        "joins those that no other beats in both.",
    ),
    Picture(
        "methods",
        "reduction",
        f"{THREE} --methods",
        "Guyan's third frequency is 7.5 % too high, that of the regression 8.1 % too low; IRS"
        " comes within 1.1 %, with masses that are no longer diagonal.",
    ),
    Picture(
        "reduced-response",
        "reduction",
        f"{THREE} --response auto",
        "Up to 3000 rpm, beside the critical speed, three masses answer as the rotor does within 2 %;"
        " near the second critical speed they do not.",
    ),
    Picture(
        "reduced-stability",
        "reduction",
        f"reduce {COMPRESSOR} --nodes 8,14,20 --modes 1 --stability 1000:14000rpm",
        "The rotor becomes unstable at 10 932 rpm, the three masses at 11 153 rpm: the small model "
        "keeps the threshold within about 2 %.",
    ),
    Picture(
        "identify",
        "identification",
        f"identify {IDENTIFY}/section_1_6/model.toml {IDENTIFY}/section_1_6/data.csv --errors 2,1",
        "The model passes through all amplitudes and phases within their errors; these tell the three "
        "damping coefficients to 7, 16 and 11 %.",
    ),
    Picture(
        "circles",
        "identification",
        "modes sample_data/modes/amplitudes.csv --excitation force --errors 2,1",
        "All three resonances are read on both sides, and the readings lie on the circles and peaks of "
        "one fit; in the third mode the circle of X3 is small.",
    ),
    Picture(
        "shapes",
        "identification",
        f"identify {IDENTIFY}/task_7_1/model.toml {IDENTIFY}/task_7_1/data.csv",
        "The three springs that were found give the measured natural frequencies within 0.2 %, and "
        "the measured shapes.",
    ),
    Picture(
        "fit",
        "identification",
        f"fit {FIT}/run_down/model.toml {FIT}/run_down/record.csv",
        "The model follows all three readings and leaves no pattern; the damping at the ends is known"
        " to about 10 %, the mass in the middle to 0.02 %.",
        dense=True,
    ),
    Picture(
        "run-up-bode",
        "instruments",
        f"runup {RUN_UP}",
        "Two modes explain the run-up to the line. Its peaks come 40 rpm after the critical speeds, because "
        "it takes 24 s.",
        dense=True,
    ),
    Picture(
        "tacho",
        "instruments",
        f"vectors {RUN_UP}",
        "No mark is missing. At the end a pulse is half a sample, 0.8°, early or late; the angle, "
        "through all of them, is not.",
        dense=True,
    ),
    Picture(
        "bearings",
        "motion",
        f"bearings {MOTION}/rotor.toml --speeds 1000:9000:250rpm",
        "The journals rise with the speed, aside with the rotation; a rigid rotor would be stable nearly up "
        "to 9000 rpm, this one, which bends, up to 6407 rpm.",
    ),
    Picture(
        "run-up",
        "motion",
        f"motion {MOTION}/unbalanced.toml --run-up 600:6200rpm --time 10s --view bode",
        "The run-up passes the first critical speed later and lower than in steady motion, and the second "
        "one, which the bearings damp well, as in steady motion.",
        dense=True,
    ),
    Picture(
        "whip",
        "motion",
        f"motion {MOTION}/small.toml --speed 9000rpm --time 20s --displaced 7=500um,12=500um,18=500um "
        "--view orbits",
        "After a push the rotor whips at 1302 rpm: its journals go round near their clearance circle, its "
        "middle with 5.6 mm.",
        dense=True,
    ),
    Picture(
        "jumps",
        "motion",
        f"periodic {MOTION}/damper.toml --speeds 1000:5000rpm",
        "A squeeze-film damper: between 2663 and 3056 rpm there are two stable motions; a run-up jumps "
        "down, a run-down up.",
        dense=True,
    ),
    Picture(
        "cycle",
        "motion",
        f"periodic {MOTION}/small.toml --speeds 11000:13000rpm --limit-cycle",
        "At 11748 rpm the rotor begins to whirl of itself, at 0.37 of its speed; that whirl is stable up to "
        "11868 rpm only, and beyond its fold grows while the speed falls.",
    ),
)
FIGURES = {one.name: one for one in GALLERY}
"""The same by name."""


@functools.cache
def picture(name: str) -> bytes:
    """Run the command of a figure in the folder of the repository, and return what it draws.

    Raises
    ------
    KeyError
        For a name that is not in `FIGURES`.
    """
    import matplotlib

    from rotorid.cli import application

    commands = [shlex.split(command) for command in (FIGURES[name].first, FIGURES[name].command) if command]
    with (
        mock.patch.dict(os.environ, {"SOURCE_DATE_EPOCH": "0"}),
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
        matplotlib.rc_context({"svg.hashsalt": name}),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")
        os.symlink(ROOT / "sample_data", "sample_data")
        target = Path(folder) / f"{name}.{FIGURES[name].kind}"
        commands[-1] += ["--plot", str(target)]
        for words in commands:
            application(words)(words, standalone_mode=False)
        return target.read_bytes()


def width(drawn: bytes) -> float:
    """Width of a picture, inches."""
    if drawn.startswith(b"\x89PNG"):
        return int.from_bytes(drawn[16:20], "big") / PNG_DOTS
    found = re.search(rb'<svg[^>]* width="([\d.]+)pt"', drawn)
    if found is None:
        raise ValueError("neither a .png nor an .svg with a width in points")
    return float(found[1]) / 72


if __name__ == "__main__":  # python docs/figures.py FOLDER [NAME …]: the pictures as files, to be looked at
    import sys

    for each in sys.argv[2:] or FIGURES:
        (Path(sys.argv[1]) / f"{each}.{FIGURES[each].kind}").write_bytes(picture(each))
