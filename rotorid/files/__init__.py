"""Files of people and instruments: runs, weights and influence tables, read into SI and written."""
