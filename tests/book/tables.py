"""Which table of printed numbers is computed by what; every row with its number."""

from functools import cache

from book import lessons, published, records, rotor
from book.printed import Row, lines, read

TABLES = {
    "s_rotor": rotor.speeds_and_shapes,
    "s_masses": rotor.masses,
    "s_lessons": lessons.lessons,
    "s_equations": lessons.equations,
    "q_tables": records.quasilinearization,
    "f_record": records.three_masses,
    "balancing": published.balancing,
}


@cache
def rows(name):
    """Rows of a table by source and quantity."""
    return _equations() if name == "s_equations" else read(f"{name}.csv")


@cache
def computed(name):
    """Computed numbers of a table by source and quantity."""
    return TABLES[name]()


def _equations():
    """Two rows a misprint: what the printed equation leaves is not 0, what the corrected one leaves is."""
    found, rest = (
        {},
        {"tolerance": "1e-9", "reason": "a share of the larger side, of which rounding leaves less"},
    )
    for line in lines("s_equations.csv"):
        for words, why, erratum in (("printed", "printed", line["erratum"]), ("corrected", "elsewhere", "")):
            quantity = f"{line['quantity']}, left as {words}"
            row = Row(lessons.EQUATIONS, quantity, "0", why, erratum=erratum, **rest)
            found[row.key] = row
    return found
