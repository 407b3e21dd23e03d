"""Waveforms in files of arrays (.mat, .npz): named vectors or one matrix, and the rate or times."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rotorid.base.arrays import AnyArray
from rotorid.base.text import listing
from rotorid.tables.waveforms.sampled_file import Sampled, library, refusal, sampled, time_unit

RATES = ("fs", "rate", "sample_rate")
"""Names of a rate in Hz, in any case; `dt` is the time between samples in s."""
NAMES = ("channels", "names")
LARGEST = 8_000_000_000
"""Bytes of all arrays: a small file may unpack to more than any memory."""


def read_mat(path: Path) -> Sampled:
    """Channels of a MAT file of any version before 7.3."""
    with library(path, "MAT"):
        from scipy.io import loadmat, whosmat

        try:
            _check_size(path, sum(int(np.prod(shape, dtype=float)) * 8 for _, shape, _ in whosmat(path)))
            found = loadmat(path, squeeze_me=True)
        except NotImplementedError:
            expected = "a MAT file before version 7.3: in MATLAB save('file.mat', 'names', …, '-v7')"
            raise refusal(path, expected) from None
        arrays = {name: np.asarray(value) for name, value in found.items() if not name.startswith("__")}
    return _of_arrays(path, arrays)


def read_npz(path: Path) -> Sampled:
    """Channels of an archive of NumPy; pickled objects in it are not read."""
    with library(path, "npz"):
        with zipfile.ZipFile(path) as archive:
            _check_size(path, sum(entry.file_size for entry in archive.infolist()))
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: np.squeeze(file[name]) for name in file.files}
    return _of_arrays(path, arrays)


def _check_size(path: Path, size: int) -> None:
    if size > LARGEST:
        raise refusal(path, f"arrays of at most {LARGEST // 10**9} GB, not {size / 1e9:.3g} GB")


def _of_arrays(path: Path, arrays: Mapping[str, AnyArray]) -> Sampled:
    """Vectors by their names, or one matrix (N, C) with its `channels`; times, a rate or `dt` beside them."""
    numbers = {name: array for name, array in arrays.items() if array.dtype.kind in "biuf"}
    vectors = {name: array for name, array in numbers.items() if array.ndim == 1 and array.size}
    matrices = [array for array in numbers.values() if array.ndim == 2]
    times = {name: array for name, array in vectors.items() if time_unit(name) is not None}
    if len(matrices) == 1 and len(times) == len(vectors):
        channels = _columns(path, matrices[0], arrays) | times
    elif vectors and not matrices:
        channels = vectors
    else:
        shapes = listing((f"{name} {array.shape}" for name, array in arrays.items()), "and")
        expected = (
            "a vector for each channel, or one matrix with a column a channel, their names in channels, and "
            f"t or fs; it has {shapes or 'nothing'}"
        )
        raise refusal(path, expected)
    return sampled(path, channels, _stated_rate(path, numbers))


def _columns(path: Path, matrix: AnyArray, arrays: Mapping[str, AnyArray]) -> dict[str, AnyArray]:
    listed = next((arrays[name] for name in NAMES if name in arrays), np.arange(1, matrix.shape[1] + 1))
    names = [str(name).strip() for name in np.atleast_1d(listed)]
    samples, columns = matrix.shape
    if len(set(names)) != columns or len(names) != columns or columns > samples:
        expected = "a matrix with a row a sample, a column a channel and a name for each"
        raise refusal(path, f"{expected}; it is {samples} × {columns} with the names {listing(names, 'and')}")
    return dict(zip(names, matrix.T, strict=True))


def _stated_rate(path: Path, numbers: Mapping[str, AnyArray]) -> float | None:
    scalars = {name.casefold(): float(array) for name, array in numbers.items() if array.ndim == 0}
    rates = [scalars[name] for name in RATES if name in scalars]
    rates += [1.0 / scalars["dt"]] if scalars.get("dt") else []
    if rates and not np.allclose(rates, rates[0], rtol=1e-6):
        raise refusal(path, f"one rate, not {listing((f'{rate:.9g} Hz' for rate in rates), 'and')}")
    return rates[0] if rates else None
