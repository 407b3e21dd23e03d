"""Jobs of many machines as Parquet tables: found in a tree, as rows, stored and read."""
