"""Waveforms in files of instruments: WAV by scipy, UFF58 by pyuff, TDMS by nptdms."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rotorid.base.arrays import AnyArray
from rotorid.base.text import listing
from rotorid.tables.waveforms.sampled_file import Sampled, library, refusal, sampled, time_unit

_DIRECTIONS = {1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z"}


def read_wav(path: Path) -> Sampled:
    """Channels "1", "2", … of a WAV file, left on disk where possible; ±1 is full scale of integers."""
    with library(path, "WAV"):
        from scipy.io import wavfile

        try:
            rate, data = wavfile.read(path, mmap=True)
        except ValueError as error:
            if "mmap=True not compatible" not in str(error):
                raise
            warnings.filterwarnings("error", "Reached EOF prematurely")  # until `library` ends
            rate, data = wavfile.read(path)
    scale = 1.0 if data.dtype.kind == "f" else 2.0 ** (1 - 8 * data.dtype.itemsize)
    if data.dtype.kind == "u":
        data = data.astype(np.int16) - 128
    columns = enumerate(np.atleast_2d(data.T), start=1)
    return sampled(path, {str(i): column for i, column in columns}, float(rate), scale)


def read_uff(path: Path) -> Sampled:
    """Channels of the time responses (dataset 58) of a UFF file, named by their first line or by node."""
    with library(path, "UFF58"):
        import pyuff

        if not path.read_bytes().rstrip().endswith(b"    -1"):
            raise refusal(path, "a whole UFF58 file; its end is missing")
        file = pyuff.UFF(str(path))
        places = np.flatnonzero(np.asarray(file.get_set_types()) == 58)
        read = (file.read_sets(int(place)) for place in places)
        sets: list[dict[str, Any]] = [one for one in read if one["func_type"] in (0, 1)]  # 0: not stated
        for one in sets:
            if one["abscissa_spacing"] != 1:
                raise refusal(path, "time responses in even steps (abscissa spacing 1)")
            if len(one["data"]) < one["num_pts"] or np.iscomplexobj(one["data"]):
                raise refusal(path, f"{one['num_pts']} real samples of each channel, not {len(one['data'])}")
    if not sets:
        raise refusal(path, "a time response (function type 1) in a dataset 58")
    channels = [one["data"][: one["num_pts"]] for one in sets]
    clocks = [(one["abscissa_min"], one["abscissa_inc"]) for one in sets]
    return sampled(path, dict(zip(names_of_sets(sets), channels, strict=True)), _common_rate(path, clocks))


def names_of_sets(sets: list[dict[str, Any]]) -> list[str]:
    """First lines where they tell the sets apart; else nodes with directions; else numbers."""
    lines = [one["id1"].strip() for one in sets]
    nodes = [f"{one['rsp_node']}{_DIRECTIONS.get(one['rsp_dir'], '')}" for one in sets]
    numbers = [str(i) for i in range(1, len(sets) + 1)]
    distinct = (
        names for names in (lines, nodes) if len(set(names)) == len(sets) and not {"", "NONE"} & {*names}
    )
    return next(distinct, numbers)


def read_tdms(path: Path) -> Sampled:
    """Channels of all groups of a TDMS file; where a name occurs twice they are named group/channel."""
    with library(path, "TDMS"):
        import nptdms
        from nptdms.log import log_manager

        log_manager.set_level(logging.CRITICAL)
        file = nptdms.TdmsFile.read(path)
        if file.file_status.incomplete_final_segment:
            raise refusal(path, "a whole TDMS file; its end is missing")
        found = [channel for group in file.groups() for channel in group.channels() if len(channel)]
        named = [channel.name for channel in found]
        unique = len(set(named)) == len(named)
        data: dict[str, AnyArray] = {}
        clocks = []
        for channel in found:
            samples = channel[:]
            if getattr(samples, "dtype", np.dtype(object)).kind in "biuf":
                data[channel.name if unique else f"{channel.group_name}/{channel.name}"] = samples
                if time_unit(channel.name) is None:
                    clocks.append(_clock(channel.properties))
    return sampled(path, data, _common_rate(path, clocks))


def _clock(properties: Mapping[str, Any]) -> tuple[float, float]:
    begun = properties.get("wf_start_time")
    start = 0.0 if begun is None else np.datetime64(begun, "us").astype(np.int64) / 1e6
    return start + properties.get("wf_start_offset", 0.0), properties.get("wf_increment", 0.0)


def _common_rate(path: Path, clocks: list[tuple[float, float]]) -> float | None:
    """The rate of channels with these beginnings and steps in s, None where none has a step."""
    steps = {step for _, step in clocks}
    if not any(steps):
        return None
    if not np.allclose([*steps], max(steps), rtol=1e-6):
        shown = listing((f"{step:.6g} s" for step in sorted(steps)), "and")
        raise refusal(path, f"channels of one rate; the steps are {shown}")
    if np.ptp([start for start, _ in clocks]) > 0.5 * max(steps):
        raise refusal(path, "channels that begin together")
    return 1.0 / max(steps)
