"""Files of waveforms as the libraries of each format write them."""

import numpy as np
from scipy.io import savemat, wavfile

RATE = 5120.0
SUFFIXES = (".csv", ".wav", ".mat", ".npz")


def drawn(n=400, seed=0):
    """A tacho and two sensors, times n."""
    rng = np.random.default_rng(seed)
    pulses = np.where(np.arange(n) % 64 < 4, 5.0, 0.0)
    return {"KEY": pulses, "B1X": rng.normal(size=n), "B1Y": rng.normal(size=n)}


def write(path, channels=None, rate=RATE):
    """A file of the format of its suffix; the channels of a WAV file are numbers, in ±10 of full scale."""
    channels = drawn() if channels is None else channels
    n = len(next(iter(channels.values())))
    if path.suffix == ".csv":
        table = np.column_stack([np.arange(n) / rate, *channels.values()])
        header = ",".join(["t_s", *channels])
        np.savetxt(path, table, fmt="%.9g", delimiter=",", header=header, comments="")
    elif path.suffix == ".wav":
        wavfile.write(path, int(rate), np.column_stack([*channels.values()]).astype(np.float32))
    elif path.suffix == ".mat":
        # compressed, as MATLAB does: of others with a damaged type of element scipy 1.17 ends the process
        savemat(path, {**channels, "fs": rate}, do_compression=True)
    else:
        np.savez(path, **channels, fs=rate)
    return path
