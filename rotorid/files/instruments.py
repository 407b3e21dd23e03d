"""Records of instruments: channels sampled together, from CSV, WAV, MAT, npz, UFF58 and TDMS files.

A reader returns channels by name as they are stored (perhaps left on disk), times among them; `read_samples`
takes the times out, which give the rate, and checks that they are even. Frequency responses of UFF58 files
are H e^{iωt} of a displacement, velocity or acceleration by force: velocities and accelerations are divided
by iω and (iω)².
"""

from __future__ import annotations

import codecs
import csv
import logging
import re
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.cells import decode
from rotorid.files.cells import readable as why_not_readable
from rotorid.files.headings import read_unit, readable
from rotorid.files.input_file import first_bytes
from rotorid.files.problems import InputError, Problem, Problems, printable
from rotorid.files.units import TIME, Unit, spelt

LARGEST_SHIFT = 0.3
"""Of a time from its place, in steps: times may be rounded; a missing sample shifts one by 0.5 or more."""
LARGEST = 8_000_000_000
"""Bytes of all arrays: a small file may unpack to more than any memory."""
HEAD = 65_536
"""Bytes in which the form of a text file shows."""
RATES = ("fs", "rate", "sample_rate")
"""Names of a rate in Hz, in any case; `dt` is the time between samples in s."""
RESPONSE = 4
_NUMBER = re.compile(r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?")
_DIRECTIONS = {1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z"}
_ORDER = {8: 0, 11: 1, 12: 2}
"""How often a quantity of these data types of dataset 58 is differentiated."""


@dataclass(frozen=True, eq=False)
class Sampled:
    """Channels of one file, sampled together.

    Attributes
    ----------
    channels
        By name, as they are stored, each of shape (N,).
    rate
        Samples a second; None: the file does not say.
    scale
        What one stored number counts.
    first_row
        Of a text file, where the first sample stands.
    """

    channels: Mapping[str, AnyArray]
    rate: float | None = None
    scale: float = 1.0
    first_row: int = 1


def refusal(
    path: Path, expected: str, row: int | None = None, column: str | None = None, value: str | None = None
) -> InputError:
    """To be raised: one problem of a file."""
    return InputError([Problem(str(path), row, column, value, expected)])


def read_samples(path: Path) -> Sampled:
    """Channels of a file of one of the `READERS`, without that of the times, which gives the rate.

    Raises
    ------
    InputError
        For a file that cannot be read, times that are not even, channels of different lengths, and none.
    """
    try:
        first_bytes(path, 1)
    except (OSError, ValueError) as error:
        raise refusal(path, why_not_readable(path, error)) from error
    if path.suffix.lower() not in READERS:
        raise refusal(path, f"waveforms in a file {listing(READERS)}")
    kind, read = READERS[path.suffix.lower()]
    with _library(path, kind):
        sampled = read(path)
    lengths = {name: len(channel) for name, channel in sampled.channels.items()}
    if len(set(lengths.values())) != 1 or min(lengths.values()) < 2:
        shown = listing((f"{name} {length}" for name, length in lengths.items()), "and") or "none"
        raise refusal(path, f"channels of one length, 2 samples or more; the numbers of samples: {shown}")
    clock = next((name for name in sampled.channels if time_unit(name)), None)
    if clock is not None:
        rest = {name: channel for name, channel in sampled.channels.items() if name != clock}
        sampled = replace(sampled, channels=rest, rate=_rate(path, clock, sampled))
    if sampled.rate is not None and not 0 < sampled.rate < np.inf:
        raise refusal(path, f"a rate above 0, not {sampled.rate:g}")
    return sampled


@contextmanager
def _library(path: Path, kind: str) -> Iterator[None]:
    """While a library reads a file: whatever fails is one `InputError`, its warnings are not shown."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except ImportError as error:
        raise refusal(path, f"what reads {kind} files to be installed: pip install {error.name}") from error
    except Exception as error:
        reason = f" ({printable(str(error)[:80])})" if isinstance(error, ValueError) else ""
        raise refusal(path, f"a whole {kind} file; it is damaged or of another kind{reason}") from error


def time_unit(name: str) -> Unit | None:
    """The unit of times in a channel of this name, s if it says none; None for another channel."""
    words = re.findall(r"[^\W_]+", spelt(name))
    is_time = 1 <= len(words) <= 2 and (words[0] == "t" or words[0].casefold() == "time")
    return TIME.get((*words, "s")[1]) if is_time else None


def _rate(path: Path, clock: str, sampled: Sampled) -> float:
    """Of times in even steps, by a straight line through them."""
    times, unit = sampled.channels[clock], time_unit(clock) or TIME["s"]
    number = np.arange(len(times)) - (len(times) - 1) / 2
    step = float(number @ times / (number @ number))
    wrong = ~(np.abs(times - np.mean(times) - step * number) <= LARGEST_SHIFT * step)
    if step > 0 and not wrong.any():
        return 1.0 / unit.to_si(step)
    jumps = np.diff(times)
    usual = float(np.nanmedian(jumps))
    odd = ~(np.abs(jumps - usual) <= LARGEST_SHIFT * abs(usual))
    at = 1 + int(np.argmax(odd if odd.any() else wrong[1:]))
    expected = f"times in even steps, {usual:.6g} {unit.name} here, or no such column and a stated rate"
    value = "" if np.isnan(times[at]) else f"{times[at]:.9g}"
    raise refusal(path, expected, at + sampled.first_row, clock, value)


def _read_text(path: Path) -> Sampled:
    """A column a channel; a preamble may stand above the header, a row of units below it."""
    import pandas as pd

    head, problems = first_bytes(path, HEAD), Problems()
    wide = head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    if len(head) == HEAD and not wide:
        head = head[: head.rfind(b"\n") + 1] or head
    lines = re.split(r"\r\n|\n|\r", problems.need(decode(str(path), head, problems)))
    later = lines[len(lines) // 2 :]
    separator = max("\t;,", key=lambda sign: sum(sign in line for line in later))
    rows = [[*map(str.strip, next(csv.reader([line], delimiter=separator), []))] for line in lines]
    kinds = [tuple(_NUMBER.fullmatch(cell) is not None for cell in row) for row in rows]
    usual = Counter(kind for kind in kinds if any(kind)).most_common(1)
    if not usual:
        raise refusal(path, "a table: a column a channel, a row a sample, and names above the numbers")
    above, places = kinds.index(usual[0][0]), np.flatnonzero(usual[0][0]).tolist()
    names = _names(path, rows[:above], places)
    comma = separator != "," and any("," in row[i] for row in rows[above:] for i in places if i < len(row))
    form: dict[str, Any] = {"sep": separator, "decimal": "," if comma else ".", "low_memory": False}
    with path.open(encoding="utf-16" if wide else "latin-1", errors="replace", newline="") as text:
        for _ in range(above):
            text.readline()
        try:
            frame = pd.read_csv(text, header=None, skip_blank_lines=False, skipinitialspace=True, **form)
        except ValueError as error:  # a ParserError too
            raise refusal(
                path, f"rows of numbers; counted below row {above}: {str(error).strip()}"
            ) from error
    cells = frame[places].replace(",", ".", regex=True) if comma else frame[places]
    table = cells.apply(pd.to_numeric, errors="coerce")
    for at, k in np.argwhere((table.isna() & cells.notna()).to_numpy())[:1]:
        raise refusal(path, "a number alone", at + above + 1, names[k], str(frame[places[k]][at]))
    filled = np.flatnonzero(table.notna().any(axis=1))
    numbers = np.array(table[: filled[-1] + 1 if filled.size else 0].to_numpy(dtype=float).T, order="C")
    return Sampled(dict(zip(names, numbers, strict=True)), first_row=above + 1)


def _names(path: Path, preamble: list[list[str]], places: list[int]) -> list[str]:
    """Names of columns in the last row that has one for each, or in that above a row of units."""
    headers = [row for row in preamble if len(row) > places[-1] and any(row)]
    if not headers:
        raise refusal(path, "a row with a name for each column above the numbers", len(preamble) + 1)
    names = [headers[-1][i].lstrip("# ") for i in places]
    below = [spelt(cell.strip("[]() ")) for cell in names]
    if len(headers) > 1 and below[0] in TIME:
        names = [f"{headers[-2][i]}_{unit}".strip("#_ ") for i, unit in zip(places, below, strict=True)]
    if bad := [name for name in names if not name or names.count(name) > 1]:
        raise refusal(path, "a name for each column of numbers, each once", len(preamble), None, bad[0])
    return names


def _read_wav(path: Path) -> Sampled:
    """Channels "1", "2", … of a WAV file, left on disk where possible; ±1 is full scale of integers."""
    from scipy.io import wavfile

    try:
        rate, data = wavfile.read(path, mmap=True)
    except ValueError as error:
        if "mmap=True not compatible" not in str(error):
            raise
        warnings.filterwarnings("error", "Reached EOF prematurely")  # until `_library` ends
        rate, data = wavfile.read(path)
    scale = 1.0 if data.dtype.kind == "f" else 2.0 ** (1 - 8 * data.dtype.itemsize)
    if data.dtype.kind == "u":
        data = data.astype(np.int16) - 128
    columns = enumerate(np.atleast_2d(data.T), start=1)
    return Sampled({str(i): column for i, column in columns}, float(rate), scale)


def _read_mat(path: Path) -> Sampled:
    from scipy.io import loadmat, whosmat

    try:
        _check_size(path, sum(int(np.prod(shape, dtype=float)) * 8 for _, shape, _ in whosmat(path)))
        arrays = loadmat(path, squeeze_me=True)
    except NotImplementedError:
        expected = "a MAT file before version 7.3: in MATLAB save('file.mat', 'names', …, '-v7')"
        raise refusal(path, expected) from None
    return _of_arrays(path, {k: np.asarray(v) for k, v in arrays.items() if not k.startswith("__")})


def _read_npz(path: Path) -> Sampled:
    """Of an archive of NumPy; pickled objects in it are not read."""
    with zipfile.ZipFile(path) as archive:
        _check_size(path, sum(entry.file_size for entry in archive.infolist()))
    with np.load(path, allow_pickle=False) as file:
        return _of_arrays(path, {name: np.squeeze(file[name]) for name in file.files})


def _check_size(path: Path, size: int) -> None:
    if size > LARGEST:
        raise refusal(path, f"arrays of at most {LARGEST // 10**9} GB, not {size / 1e9:.3g} GB")


def _of_arrays(path: Path, arrays: Mapping[str, AnyArray]) -> Sampled:
    """Vectors by their names, or one matrix (N, C) with its `channels`; times, a rate or `dt` beside them."""
    numbers = {name: array for name, array in arrays.items() if array.dtype.kind in "biuf"}
    channels = {name: array for name, array in numbers.items() if array.ndim == 1 and array.size}
    matrices, fit = [array for array in numbers.values() if array.ndim > 1], bool(channels)
    if matrices:
        matrix = matrices[0]
        listed = arrays.get("channels", arrays.get("names", np.arange(1, matrix.shape[1] + 1)))
        names = [str(name).strip() for name in np.atleast_1d(listed)]
        fit = len(matrices) == 1 and all(map(time_unit, channels))
        fit = fit and len({*names}) == matrix.shape[1] and len(names) <= len(matrix)
        channels |= dict(zip(names, matrix.T, strict=False))
    if not fit:
        shapes = listing((f"{name} {array.shape}" for name, array in arrays.items()), "and") or "nothing"
        expected = (
            "a vector for each channel, or one matrix with a row a sample, a column a channel, their names"
        )
        raise refusal(path, f"{expected} in channels, and t or fs; it has {shapes}")
    scalars = {name.casefold(): float(array) for name, array in numbers.items() if array.ndim == 0}
    rates = [scalars[name] for name in RATES if name in scalars]
    rates += [1.0 / scalars["dt"]] if scalars.get("dt") else []
    if rates and not np.allclose(rates, rates[0], rtol=1e-6):
        raise refusal(path, f"one rate, not {listing((f'{rate:.9g} Hz' for rate in rates), 'and')}")
    return Sampled(channels, rates[0] if rates else None)


def _read_uff(path: Path) -> Sampled:
    """Channels of the time responses (function type 1; 0: not stated)."""
    sets = _sets_58(path, (0, 1), "a time response (function type 1)")
    for one in sets:
        if one["abscissa_spacing"] != 1:
            raise refusal(path, "time responses in even steps (abscissa spacing 1)")
        if len(one["data"]) < one["num_pts"] or np.iscomplexobj(one["data"]):
            raise refusal(path, f"{one['num_pts']} real samples of each channel, not {len(one['data'])}")
    channels = [one["data"][: one["num_pts"]] for one in sets]
    clocks = [(one["abscissa_min"], one["abscissa_inc"]) for one in sets]
    return Sampled(dict(zip(_names_of_sets(sets), channels, strict=True)), _common_rate(path, clocks))


def _sets_58(path: Path, types: tuple[int, ...], what: str) -> list[dict[str, Any]]:
    import pyuff

    if not path.read_bytes().rstrip().endswith(b"    -1"):
        raise refusal(path, "a whole UFF58 file; its end is missing")
    file = pyuff.UFF(str(path))
    places = np.flatnonzero(np.asarray(file.get_set_types()) == 58)
    sets = [one for place in places if (one := file.read_sets(int(place)))["func_type"] in types]
    if not sets:
        raise refusal(path, f"{what} in a dataset 58")
    return sets


def _names_of_sets(sets: list[dict[str, Any]]) -> list[str]:
    """First lines where they tell the sets apart; else nodes with directions; else numbers."""
    lines = [one["id1"].strip() for one in sets]
    nodes = [f"{one['rsp_node']}{_DIRECTIONS.get(one['rsp_dir'], '')}" for one in sets]
    for names in (lines, nodes):
        if len({*names}) == len(sets) and not {"", "NONE"} & {*names}:
            return names
    return [str(i) for i in range(1, len(sets) + 1)]


def _read_tdms(path: Path) -> Sampled:
    """Channels of all groups of a TDMS file; a name that stood before is group/channel."""
    import nptdms
    from nptdms.log import log_manager

    log_manager.set_level(logging.CRITICAL)
    file = nptdms.TdmsFile.read(path)
    if file.file_status.incomplete_final_segment:
        raise refusal(path, "a whole TDMS file; its end is missing")
    data, clocks = dict[str, AnyArray](), []
    for channel in [channel for group in file.groups() for channel in group.channels() if len(channel)]:
        samples, stated = channel[:], channel.properties
        if getattr(samples, "dtype", np.dtype(object)).kind in "biuf":
            data[f"{channel.group_name}/{channel.name}" if channel.name in data else channel.name] = samples
            if time_unit(channel.name) is None:
                begun = np.datetime64(stated.get("wf_start_time", 0), "us").astype(np.int64) / 1e6
                clocks.append((begun + stated.get("wf_start_offset", 0.0), stated.get("wf_increment", 0.0)))
    return Sampled(data, _common_rate(path, clocks))


def _common_rate(path: Path, clocks: list[tuple[float, float]]) -> float | None:
    """The rate of channels with these beginnings and steps in s, None where none has a step."""
    steps = sorted({step for _, step in clocks})
    if not any(steps):
        return None
    if not np.allclose(steps, steps[-1], rtol=1e-6):
        shown = listing((f"{step:.6g} s" for step in steps), "and")
        raise refusal(path, f"channels of one rate; the steps are {shown}")
    if np.ptp([start for start, _ in clocks]) > 0.5 * steps[-1]:
        raise refusal(path, "channels that begin together")
    return 1.0 / steps[-1]


READERS: Mapping[str, tuple[str, Callable[[Path], Sampled]]] = {
    ".csv": ("CSV", _read_text),
    ".txt": ("CSV", _read_text),
    ".wav": ("WAV", _read_wav),
    ".mat": ("MAT", _read_mat),
    ".npz": ("npz", _read_npz),
    ".uff": ("UFF58", _read_uff),
    ".unv": ("UFF58", _read_uff),
    ".tdms": ("TDMS", _read_tdms),
}
"""Kinds and readers by the suffix of a file."""


def read_responses(path: Path) -> tuple[FloatArray, dict[str, ComplexArray]]:
    """Frequency responses of a UFF58 file: frequencies above 0, rad/s (n,), and m/N by point, (n,) each.

    Raises
    ------
    InputError
        Without responses to one force at frequencies that all of them have, in known units; without pyuff.
    """
    with _library(path, "UFF58"):
        sets = _sets_58(path, (RESPONSE,), f"frequency responses (function type {RESPONSE})")
        if len({(one["ref_node"], one["ref_dir"]) for one in sets}) > 1:
            raise refusal(path, "responses to one force, not to several")
        hertz = np.asarray(sets[0]["x"], dtype=float)
        used = hertz > 0
        omega = 2.0 * np.pi * hertz[used]
        signals: dict[str, ComplexArray] = {}
        for name, one in zip(_names_of_sets(sets), sets, strict=True):
            if len(one["x"]) != len(hertz) or not np.allclose(one["x"], hertz, rtol=1e-6) or not used.any():
                raise refusal(path, "responses at the same frequencies, above 0")
            factor, order = _unit_of_response(path, one)
            signals[name] = np.asarray(one["data"], dtype=complex)[used] * factor / (1j * omega) ** order
            if not np.isfinite(signals[name]).all():
                raise refusal(path, "finite numbers")
    return omega, signals


def _unit_of_response(path: Path, one: dict[str, Any]) -> tuple[float, int]:
    """A response in SI by its number, and how often a displacement is differentiated in it."""
    labels = (str(one[f"{part}_axis_units_lab"] or "") for part in ("ordinate", "orddenom"))
    motion, force = (label.strip().replace("^", "").removeprefix("NONE") for label in labels)
    kind = one["ordinate_spec_data_type"]
    if not motion and kind in _ORDER:
        return 1.0, _ORDER[kind]
    if not motion or not readable("amplitude", motion) or force not in ("", *units.FORCE):
        expected = "responses of a displacement, velocity or acceleration by a force, such as m/s^2 by N"
        raise refusal(path, expected, value=f"{motion or kind} by {force or 'no unit'}")
    unit = units.VIBRATION[read_unit("amplitude", motion)[0]]
    per = units.FORCE[force or "N"].to_si(1.0)
    return unit.to_si(1.0) / per, ["length", "velocity", "acceleration"].index(unit.kind)
