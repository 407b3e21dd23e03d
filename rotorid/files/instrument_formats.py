"""Records of instruments: channels sampled together, from CSV, WAV, MAT and npz files; responses from UFF58.

A reader returns channels by name as they are stored; `read_samples` takes the times out, which give the
rate, and checks that they are even. Frequency responses are H e^{iωt} of a displacement, velocity or
acceleration by force: velocities and accelerations are divided by iω and (iω)².
"""

from __future__ import annotations

import csv
import io
import re
import warnings
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.base.text import listing
from rotorid.files.cells import decode
from rotorid.files.disk import file_content, first_bytes, why_unreadable
from rotorid.files.input_problems import InputError, printable, refusal
from rotorid.files.units import FORCE, TIME, VIBRATION, Unit, spelt

DERIVATIVE = {"length": 0, "velocity": 1, "acceleration": 2}
"""How often a displacement is differentiated, by the kind of its unit."""
LARGEST_SHIFT = 0.3
"""Of a time from its place, in steps: times may be rounded; a missing sample shifts one by 0.5 or more."""
LARGEST = 8_000_000_000
"""Bytes of all arrays: a small file may unpack to more than any memory."""
HEAD = 1000
"""Lines in which the form of a text file shows."""
RATES = ("fs", "rate", "sample_rate")
"""Names of a rate in Hz, in any case; `dt` is the time between samples in s."""
_NUMBER = re.compile(r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?")
_CLOCK = re.compile(rf"(?:t|(?i:time))(?:[\W_]+({'|'.join(TIME)}))?[\W_]*")
_SI = {8: "m", 11: "m_s", 12: "m_s2"}
"""Units of the data types of dataset 58, where it has no label of one."""
_DIRECTIONS = {1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z"}


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


def read_samples(path: Path) -> Sampled:
    """Channels of a file of one of the `READERS`, without that of the times, which gives the rate.

    Raises
    ------
    InputError
        For a file that cannot be read, times that are not even, channels of different lengths, and none.
    """
    with _reading(path):
        first_bytes(path, 1)
        reader = READERS.get(path.suffix.lower())
        if reader is None:
            raise refusal(path, f"waveforms in a file {listing(READERS)}")
        sampled = reader(path)
    lengths = {name: len(channel) for name, channel in sampled.channels.items()}
    if len({*lengths.values()}) != 1 or min(lengths.values()) < 2:
        shown = listing((f"{name} {length}" for name, length in lengths.items()), "and") or "none"
        raise refusal(path, f"channels of one length, 2 samples or more; the numbers of samples: {shown}")
    rest, rate = {**sampled.channels}, sampled.rate
    clock = next(filter(time_unit, rest), None)
    if clock is not None:
        rate = _rate(path, clock, rest.pop(clock), sampled.first_row)
    if rate is not None and not 0 < rate < np.inf:
        raise refusal(path, f"a rate above 0, not {rate:g}")
    return replace(sampled, channels=rest, rate=rate)


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """While a library reads a file: whatever fails is one `InputError`, its warnings are not shown."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except OSError as error:
        raise refusal(path, why_unreadable(path, error)) from error
    except ImportError as error:
        raise refusal(path, f"what reads it to be installed: pip install {error.name}") from error
    except Exception as error:
        reason = f" ({printable(str(error)[:80])})" if isinstance(error, ValueError) else ""
        expected = f"a whole {path.suffix} file; it is damaged or of another kind{reason}"
        if isinstance(error, NotImplementedError) and path.suffix.lower() == ".mat":
            expected = "a MAT file before version 7.3: in MATLAB save('file.mat', 'names', …, '-v7')"
        raise refusal(path, expected) from error


def time_unit(name: str) -> Unit | None:
    """The unit of times in a channel of this name, s if it says none; None for another channel."""
    match = _CLOCK.fullmatch(spelt(name))
    return match and TIME[match[1] or "s"]


def _rate(path: Path, clock: str, times: AnyArray, first_row: int) -> float:
    """Of times in even steps, by a straight line through them."""
    unit = time_unit(clock) or TIME["s"]
    number = np.arange(len(times)) - (len(times) - 1) / 2
    step = float(number @ times / (number @ number))
    off = abs(times - times.mean() - step * number)
    if step > 0 and (off <= LARGEST_SHIFT * step).all():
        return 1.0 / unit.to_si(step)
    usual = float(np.nanmedian(np.diff(times)))
    even = abs(times - times[0] - usual * np.arange(len(times))) <= LARGEST_SHIFT * abs(usual)
    at = int(even.argmin())
    expected = f"times in even steps, {usual:.6g} {unit.name} here, or no such column and a stated rate"
    value = "" if np.isnan(times[at]) else f"{times[at]:.9g}"
    raise refusal(path, expected, at + first_row, clock, value)


def _read_text(path: Path) -> Sampled:
    """A column a channel; a preamble may stand above the header, a row of units below it."""
    import pandas as pd

    text = re.sub(r"\r\n?", "\n", decode(str(path), file_content(path)))
    lines = text.split("\n", HEAD)[:HEAD]
    separator = max("\t;,", key=lambda sign: sum(sign in line for line in lines[len(lines) // 2 :]))
    rows = [[*map(str.strip, next(csv.reader([line], delimiter=separator), ()))] for line in lines]
    numbers = [[k for k, cell in enumerate(row) if _NUMBER.fullmatch(cell)] for row in rows]
    places = max(filter(None, numbers), key=numbers.count, default=[-1])
    above = numbers.index(places) if places in numbers else 0
    headers = [[row[k] for k in places] for row in rows[:above] if len(row) > places[-1] and any(row)]
    names = [name.strip("#_ ") for name in (headers or [[""]])[-1]]
    unit = [spelt(name.strip("[]() ")) for name in names]
    if len(headers) > 1 and unit[0] in TIME:
        names = ["_".join(pair).strip("#_ ") for pair in zip(headers[-2], unit, strict=True)]
    if bad := [name for name in names if not name or names.count(name) > 1]:
        expected = "a column a channel, a row a sample, and above them a name for each column, each once"
        raise refusal(path, expected, above or 1, None, bad[0])
    body = text.split("\n", above)[-1].encode()
    stream = io.BytesIO(body if separator == "," else body.replace(b",", b"."))
    try:
        frame = pd.read_csv(stream, sep=separator, header=None, skip_blank_lines=False, skipinitialspace=True)
    except ValueError as error:  # a ParserError too
        raise refusal(path, f"rows of numbers; counted below row {above}: {str(error).strip()}") from error
    cells = frame[places]
    table = cells.apply(pd.to_numeric, errors="coerce")
    for at, k in np.argwhere((table.isna() & cells.notna()).to_numpy())[:1]:
        raise refusal(path, "a number alone", at + above + 1, names[k], str(cells.iat[at, k]))
    samples = table.loc[: table.last_valid_index()].to_numpy(dtype=float).T
    return Sampled(dict(zip(names, np.ascontiguousarray(samples), strict=True)), first_row=above + 1)


def _read_wav(path: Path) -> Sampled:
    """Channels "1", "2", … of a WAV file; ±1 is full scale of integers."""
    from scipy.io import wavfile

    warnings.filterwarnings("error", "Reached EOF prematurely")  # until `_reading` ends
    rate, data = wavfile.read(path)
    scale = 1.0 if data.dtype.kind == "f" else 2.0 ** (1 - 8 * data.dtype.itemsize)
    if data.dtype.kind == "u":
        data = data.astype(np.int16) - 128
    columns = enumerate(np.atleast_2d(data.T), start=1)
    return Sampled({str(i): column for i, column in columns}, float(rate), scale)


def _read_arrays(path: Path) -> Sampled:
    """Of a MAT file or an archive of NumPy, of which pickled objects are not read.

    Vectors by their names, or a matrix (N, C) with its `channels`; times, a rate or `dt` beside them.
    """
    from scipy.io import loadmat, whosmat

    numpy = path.suffix.lower() == ".npz"
    if numpy:
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
    else:
        size = sum(int(np.prod(shape, dtype=float)) * 8 for _, shape, _ in whosmat(path))
    if size > LARGEST:
        raise refusal(path, f"arrays of at most {LARGEST // 10**9} GB, not {size / 1e9:.3g} GB")
    with np.load(path, allow_pickle=False) if numpy else nullcontext(loadmat(path, squeeze_me=True)) as file:
        stored = dict(file)
    arrays = {name: np.squeeze(np.asarray(values)) for name, values in stored.items() if name[:2] != "__"}
    numbers = {name: array * 1 for name, array in arrays.items() if array.dtype.kind in "biuf" and array.size}
    channels = {name: array for name, array in numbers.items() if array.ndim == 1}
    count = sum(array[0].size for array in numbers.values() if array.ndim)
    for matrix in (array for array in numbers.values() if array.ndim == 2):
        listed = np.atleast_1d(arrays.get("channels", np.arange(1, matrix.shape[1] + 1)))
        if len(matrix) >= matrix.shape[1] == len(listed):
            channels |= zip((str(name).strip() for name in listed), matrix.T, strict=True)
    if not 0 < count == len(channels):
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


READERS: Mapping[str, Callable[[Path], Sampled]] = {
    ".csv": _read_text,
    ".txt": _read_text,
    ".wav": _read_wav,
    ".mat": _read_arrays,
    ".npz": _read_arrays,
}
"""By the suffix of a file."""


def read_responses(path: Path) -> tuple[FloatArray, dict[str, ComplexArray]]:
    """Frequency responses of a UFF58 file: frequencies above 0, rad/s (n,), and m/N by point, (n,) each.

    A point is named by the first line of its dataset where these tell them apart, else by node and direction.

    Raises
    ------
    InputError
        Without responses to one force at frequencies that all of them have, in known units; without pyuff.
    """
    with _reading(path):
        import pyuff

        whole = file_content(path).rstrip().endswith(b"    -1")
        file = pyuff.UFF(str(path))
        places = [k for k, kind in enumerate(file.get_set_types()) if kind == 58] if whole else []
        sets = [one for place in places if (one := file.read_sets(place))["func_type"] == 4]
        lines = [one["id1"].strip() for one in sets]
        nodes = [f"{one['rsp_node']}{_DIRECTIONS.get(one['rsp_dir'], '')}" for one in sets]
        names = lines if len({*lines} - {"", "NONE"}) == len(sets) else nodes
        axes = {(one["ref_node"], one["ref_dir"], len(one["x"])) for one in sets}
        hertz = np.array([one["x"] for one in sets] if len(axes) == 1 else [])
        if not hertz.size or len({*names}) != len(sets) or not np.allclose(hertz, hertz[0], rtol=1e-6):
            expected = (
                "a whole file with frequency responses (function type 4) in datasets 58, one of each point, "
                "to one force and at the same frequencies"
            )
            raise refusal(path, expected)
        used = hertz[0] > 0
        omega = 2.0 * np.pi * hertz[0][used]
        signals = {}
        for name, one in zip(names, sets, strict=True):
            labels = (one[f"{part}_axis_units_lab"] or "" for part in ("ordinate", "orddenom"))
            motion, force = (spelt(label.strip().replace("^", "").removeprefix("NONE")) for label in labels)
            unit = VIBRATION.get(motion or _SI.get(one["ordinate_spec_data_type"], ""))
            response = np.asarray(one["data"], dtype=complex)[used]
            if unit is None or force not in ("", *FORCE) or not np.isfinite(response).all():
                expected = "finite displacements, velocities or accelerations by a force, such as m/s^2 by N"
                raise refusal(path, expected, value=f"{motion or 'no unit'} by {force or 'no unit'}")
            size = unit.to_si(1.0) / FORCE[force or "N"].to_si(1.0)
            signals[name] = response * size / (1j * omega) ** DERIVATIVE[unit.kind]
    return omega, signals
