"""Every kind of picture of the samples, and which of its texts overlap or leave the canvas."""

import contextlib
import functools
import io
from unittest import mock

from documents import is_text, undrawn

from rotorid.cli import application
from rotorid.commands.command_line import Destination
from rotorid.samples import sample_data

COMMANDS = {
    "balance": "balance turbo_job/job.toml",
    "balance checked": "balance turbo_job/checked.toml",
    "balance graded": "balance turbo_job/job.toml --planes left,right --grade G2.5 --rotor-mass 500kg "
    "--service-speed 5400rpm",
    "balance model": "balance model_job/job.toml",
    "balance holes": "balance turbo_job/holes.toml --split",
    "balance left in": "balance left_in/job.toml",
    "balance limited": "balance turbo_job/job.toml --max-mass 430g_mm --limit 1",
    "balance in part": "balance rk4/job.toml",
    "split": "split 35g@120 --holes 24 --pieces 10g,20g --taken 3:10g --per-hole 2",
    "split two": "split 35g@120 --two 20g,30g",
    "split drill": "split 3g@120 --drill 8mm --radius 100mm",
    "trial weight": "trial-weight model_job/job.toml",
    "tolerance": "tolerance --mass 500kg --speed 3000rpm --grade G2.5 --planes left=100mm,right=600mm "
    "--bearings 0mm,700mm --centre 320mm",
    "unbalance": "unbalance model_job/job.toml --stations 6,12,19",
    "vectors": "vectors waveforms/run_up.wav --tacho 1 --unit um --phase lag",
    "vectors two": "vectors waveforms/run_up.wav --tacho 1 --unit um --phase lag --speeds 900,2000rpm",
    "vectors runs": "vectors waveforms/waveforms.toml --orders 1,2",
    "bearings": "bearings motion/rotor.toml --speeds 1000:9000:500rpm",
    "motion": "motion motion/rotor.toml --speed 4000rpm --time 0.02s --rate 500 --sensors 2,5,8,12,15,18,22",
    "motion orbits": "motion motion/unbalanced.toml --speed 3000rpm --time 0.1s --view orbits",
    "motion bode": "motion motion/unbalanced.toml --run-up 600:6200rpm --time 2s --view bode",
    "periodic": "periodic motion/damper.toml --speeds 1000:5000rpm",
    "modes": "modes modes/amplitudes.csv --excitation force --bands 24:28",
    "runup": "runup waveforms/run_up.wav --tacho 1 --unit um --phase lag",
    "critical": "critical rotor23.csv -n 3",
    "critical map": "critical compressor/rotor.toml -n 3 --map",
    "campbell": "campbell compressor/rotor.toml --speeds 1000:15000:250rpm",
    "response": "response compressor/rotor.toml --unbalance compressor/unbalance.csv "
    "--speeds 1000:15000:250rpm --operating 5300:6500rpm --sensors probe_DE:45,probe_NDE:45",
    "response orbits": "response compressor/rotor.toml --unbalance compressor/unbalance.csv "
    "--speeds 4000:6000:500rpm --sensors probe_DE:45,probe_NDE:45 --view orbits",
    "influence": "influence compressor/rotor.toml --planes impeller_1,impeller_5 "
    "--sensors probe_DE:45,probe_NDE:45 --speeds 4000:6000:1000rpm",
    "reduce": "reduce rotor23.csv --nodes 7,12,18 --modes 2",
    "reduce rank": "reduce rotor23.csv --place compromise",
    "campbell rk4": "campbell rk4/calibrated.toml --speeds 200:6000:100rpm",
    "identify": "identify identify/task_5_1/model.toml identify/task_5_1/data.csv --errors 2,1",
    "fit": "fit fit/run_down/model.toml fit/run_down/record.csv",
}
"""Command lines by what they draw; files in the sample data, _ for a blank in a name."""


@functools.cache
def outcome_of(line):
    """What a command line gives; its files are in the sample data, _ stands for a blank in a name."""
    made, words = [], []
    for word in line.split():
        file = sample_data() / word
        word = str(file) if "." in word and file.is_file() else word
        words.append(word.replace("probe_", "probe ").replace("impeller_", "impeller "))
    with (
        mock.patch.object(Destination, "deliver", lambda self, what, work, options=None: made.append(work())),
        contextlib.redirect_stdout(io.StringIO()),
    ):
        application(words)(words, prog_name="rotorid", standalone_mode=False)
    return made[0]


def figures_of(name):
    """New figures of a command, by their captions; those of a balancing sheet, too."""
    from balancing.plots import draw_plane, residual_figure
    from rotorid.base.plot_style import new_figure

    made = outcome_of(COMMANDS[name])
    figures = {caption or "picture": draw() for caption, draw in made.pictures.items()}
    if name.startswith("balance"):
        figures["readings"] = residual_figure(made.result, made.mounted, made.check, made.left)
        for plane in made.result.planes:
            for where, zero in (("right", 1.0), ("top", 1j)):
                figure = figures[f"plane {plane}, 0° {where}"] = new_figure(3.1, 3.4)
                holes = made.job.holes.get(plane)
                draw_plane(figure.add_subplot(), made.result, plane, made.mounted, holes, zero)
    return figures


def clashes(figure, slack=0.5):
    """Texts that overlap, and texts that leave the canvas, in pixels beyond `slack`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw_without_rendering()
    hidden = set(undrawn(figure))
    texts = [text for text in figure.findobj(is_text) if text not in hidden]
    boxes = [text.get_window_extent(renderer) for text in texts]
    words = [text.get_text().replace("\n", " / ") for text in texts]
    found = []
    for k, (word, box) in enumerate(zip(words, boxes, strict=True)):
        edge = figure.bbox
        if (
            box.x0 < edge.x0 - slack
            or box.x1 > edge.x1 + slack
            or box.y0 < -slack
            or box.y1 > edge.y1 + slack
        ):
            found.append(f"{word!r} leaves the canvas")
        for other, beside in zip(words[:k], boxes[:k], strict=True):
            wide = min(box.x1, beside.x1) - max(box.x0, beside.x0)
            high = min(box.y1, beside.y1) - max(box.y0, beside.y0)
            if wide > slack and high > slack and (word, box.bounds) != (other, beside.bounds):
                found.append(f"{word!r} over {other!r}")
    return found
