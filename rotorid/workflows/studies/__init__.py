"""Studies by simulation: samples drawn by number, in chunks on any executor, streamed to Parquet."""
