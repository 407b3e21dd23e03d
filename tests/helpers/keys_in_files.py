"""The tables of keys of a job in docs/files.md: `python tests/helpers/keys_in_files.py` writes them."""

from rotorid.samples import sample_data
from rotorid.tables.job import job_keys
from rotorid.tables.reader.settings_keys import key_lines

PAGE = sample_data().parent / "docs" / "files.md"
TABLES = {
    "key": job_keys.JOB,
    "key of [errors]": job_keys.ERRORS,
    "key of [key_phasor]": job_keys.KEY_PHASOR,
    "key of [slow_roll.SENSOR]": job_keys.VECTOR,
    "key of [planes.NAME]": job_keys.PLANE,
    "key of [sensors.NAME]": job_keys.SENSOR,
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
