"""Sampled signals of a machine: the tacho's pulses, vectors of orders, pictures of waveforms."""
