"""From the instrument: vectors of waveforms, and what a run-up tells."""
