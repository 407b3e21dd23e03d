"""Files of people and instruments: cells, units, settings, complaints; runs and weights in any layout."""
