"""What a file of waveforms holds: channels by name and their rate; even sampling is checked here."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rotorid.base.arrays import AnyArray
from rotorid.base.text import listing
from rotorid.files.problems import InputError, Problem, printable
from rotorid.files.units import TIME, Unit, spelt

LARGEST_SHIFT = 0.3
"""Of a time from its place, in steps: times may be rounded; a missing sample shifts one by 0.5 or more."""


@dataclass(frozen=True, eq=False)
class Sampled:
    """Channels of one file, sampled together.

    Attributes
    ----------
    rate
        Samples a second; None: the file does not say.
    channels
        By name, as they are stored, each of shape (N,).
    scale
        What one stored number counts.
    first_row
        Of a text file, where the first sample stands.
    """

    rate: float | None
    channels: Mapping[str, AnyArray]
    scale: float = 1.0
    first_row: int | None = None


def refusal(
    path: Path, expected: str, row: int | None = None, column: str | None = None, value: str | None = None
) -> InputError:
    """To be raised: one problem of a file."""
    return InputError([Problem(str(path), row, column, value, expected)])


@contextmanager
def library(path: Path, kind: str) -> Iterator[None]:
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


def sampled(
    path: Path,
    channels: Mapping[str, AnyArray],
    rate: float | None = None,
    scale: float = 1.0,
    first_row: int | None = None,
) -> Sampled:
    """The channels, without that of the times (t_s, time, Time [ms] …), which gives the rate.

    Raises
    ------
    InputError
        For times that are not even, for channels of different lengths, and where there are none.
    """
    lengths = {name: len(channel) for name, channel in channels.items()}
    if len(set(lengths.values())) != 1 or min(lengths.values()) < 2:
        shown = listing((f"{name} {length}" for name, length in lengths.items()), "and") or "none"
        raise refusal(path, f"channels of one length, 2 samples or more; the numbers of samples: {shown}")
    clock = next((name for name in channels if time_unit(name)), None)
    unit = None if clock is None else time_unit(clock)
    if clock is not None and unit is not None:
        rate = _rate(path, clock, channels[clock], unit, first_row)
    if rate is not None and not 0 < rate < np.inf:
        raise refusal(path, f"a rate above 0, not {rate:g}")
    return Sampled(rate, {k: v for k, v in channels.items() if k != clock}, scale, first_row)


def time_unit(name: str) -> Unit | None:
    """The unit of times in a channel of this name, s if it says none; None for another channel."""
    words = re.findall(r"[^\W_]+", spelt(name))
    known = 1 <= len(words) <= 2 and (words[0] == "t" or words[0].casefold() == "time")
    return TIME.get((*words, "s")[1]) if known else None


def _rate(path: Path, name: str, times: AnyArray, unit: Unit, first_row: int | None) -> float:
    number = np.arange(len(times)) - (len(times) - 1) / 2
    step = float(number @ times / (number @ number))
    wrong = ~(np.abs(times - np.mean(times) - step * number) <= LARGEST_SHIFT * step)
    if step > 0 and not wrong.any():
        return 1.0 / unit.to_si(step)
    jumps = np.diff(times, prepend=times[0])
    usual = float(np.nanmedian(jumps))
    odd = ~(np.abs(jumps - usual) <= LARGEST_SHIFT * abs(usual))[1:]
    at = 1 + int(np.argmax(odd)) if odd.any() else int(np.argmax(wrong))
    row = at + (first_row or 1)
    expected = f"times in even steps, {usual:.6g} {unit.name} here, or no such column and a stated rate"
    raise refusal(path, expected, row, name, "" if np.isnan(times[at]) else f"{times[at]:.9g}")
