"""What was measured: harmonic tests, records, natural frequencies with shapes, compliances."""
