"""From a rotor to matrices: elements, bands, the conservative pencil, both lateral planes, plain matrices."""
