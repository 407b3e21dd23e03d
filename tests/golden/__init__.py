"""The net: numbers and keys of the documents of every command, exit status and place of what is refused.

`make golden` writes them to `stored`, and the tests compare; `make golden-near` compares command lines with
another commit within tolerances, `make golden-exact` byte for byte. Nothing
here knows more of the product than `rotorid.cli.main`.
"""
