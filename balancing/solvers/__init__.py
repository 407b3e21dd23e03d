"""From coefficients and readings to correction weights: the methods, their certificates and errors."""
