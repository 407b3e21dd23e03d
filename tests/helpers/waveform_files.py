"""Files of waveforms as the libraries of each format write them."""

import warnings

import numpy as np
import pytest
from scipy.io import savemat, wavfile

RATE = 5120.0
SUFFIXES = (".csv", ".wav", ".mat", ".npz", ".uff", ".tdms")


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
    elif path.suffix == ".npz":
        np.savez(path, **channels, fs=rate)
    elif path.suffix == ".uff":
        write_uff(path, channels, rate)
    else:
        write_tdms(path, channels, {"wf_increment": 1 / rate})
    return path


def write_uff(path, channels, rate=RATE, binary=1, **more):
    """Dataset 58 for each channel."""
    pyuff = pytest.importorskip("pyuff", reason="the extra rotorid[instruments] is not installed")
    sets = [
        pyuff.prepare_58(
            **{
                "binary": binary,
                "id1": name,
                "func_type": 1,
                "rsp_node": 1,
                "rsp_dir": 1,
                "ref_node": 0,
                "ref_dir": 0,
                "abscissa_spacing": 1,
                "abscissa_min": 0.0,
                "abscissa_inc": 1 / rate,
                "abscissa_spec_data_type": 17,
                "ordinate_spec_data_type": 8,
                "orddenom_spec_data_type": 0,
                "z_axis_spec_data_type": 0,
                "num_pts": len(samples),
                "x": np.arange(len(samples)) / rate,
                "data": samples.astype(float),
                **more,
            }
        )
        for name, samples in channels.items()
    ]
    path.unlink(missing_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves files open
        pyuff.UFF(str(path)).write_sets(sets, mode="add")  # binary sets are not whole in mode "overwrite"
    return path


def write_tdms(path, channels, properties, groups=None):
    """A channel each, in the group "run" or in that of its name."""
    nptdms = pytest.importorskip("nptdms", reason="the extra rotorid[instruments] is not installed")
    objects = [
        nptdms.ChannelObject((groups or {}).get(name, "run"), name, samples, properties=properties)
        for name, samples in channels.items()
    ]
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(objects)
    return path
