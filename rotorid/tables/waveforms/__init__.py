"""Records of instruments: waveforms and their settings, from CSV, WAV, MAT, npz, UFF58 and TDMS files."""
