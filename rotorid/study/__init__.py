"""Studies: samples drawn and counted, machines that are balanced or starts of a calibration."""
