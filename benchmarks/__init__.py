"""Side-by-side benchmarks: `make bench`, or `python -m benchmarks [NAME …]` where the peers are installed.

Method: both programs solve the same problem in one process, their answers are compared before anything is
timed, every timed call gets a model made afresh just before it (peers cache results; making the model is not
timed on either side), and the shortest of several calls counts. Nothing is written to disk but in a temporary
folder. hsbalance, whose packages do not go with the others', runs in an environment and a process of its own
on the same arrays.

A benchmark is a module with `task() -> Row` or `run() -> list[Row]`, listed in `benchmarks.__main__`.
"""
