"""The net: stored outputs of every command on every sample job, model and rotor.

`make golden` writes them to `stored`; `make golden-exact` compares with another commit byte for byte; the
tests `test_golden_*.py` compare what the command line says now with what is stored. Nothing here knows
more of the product than `rotorid.cli.main`.
"""
