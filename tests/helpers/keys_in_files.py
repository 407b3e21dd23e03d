"""The tables of keys of a job in docs/files.md: `python tests/helpers/keys_in_files.py` writes them."""

from rotorid.samples import sample_data
from rotorid.tables.job import keys
from rotorid.tables.reader.key import key_lines

PAGE = sample_data().parent / "docs" / "files.md"
TABLES = {
    "key": keys.JOB,
    "key of [errors]": keys.ERRORS,
    "key of [key_phasor]": keys.KEY_PHASOR,
    "key of [slow_roll.SENSOR]": keys.VECTOR,
    "key of [planes.NAME]": keys.PLANE,
    "key of [sensors.NAME]": keys.SENSOR,
}


def with_tables(text):
    """The page with the tables between their marks written anew."""
    for title, own in TABLES.items():
        mark = f"<!-- keys: {title} -->\n"
        before, own_mark, after = text.partition(mark)
        assert own_mark, title
        lines = "\n".join(key_lines(own, title.replace("[", "`[").replace("]", "]`")))
        text = f"{before}{mark}{lines}\n{after[after.index('<!-- end -->') :]}"
    return text


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
