"""Files on disk: read once in a command, written whole or not at all."""

import errno
import hashlib

import pytest
from tables_data import complaints, the_only

from rotorid.files import disk
from rotorid.files.disk import each_file_once, file_content, sha256, write_files


@pytest.fixture
def two(tmp_path):
    """Two files that belong together, and what is to be written to them."""
    files = {tmp_path / "a.csv": b"new a", tmp_path / "b.csv": b"new b"}
    for path in files:
        path.write_bytes(b"old")
    return files


def test_what_is_written_replaces_the_file_behind_a_link_and_keeps_its_rights(tmp_path, two):
    (tmp_path / "a.csv").chmod(0o640)
    (tmp_path / "link").symlink_to("a.csv")
    (tmp_path / "b.csv").unlink()
    (tmp_path / "dangling").symlink_to("b.csv")
    write_files({tmp_path / "link": b"new a", tmp_path / "dangling": b"new b"})
    assert {path: path.read_bytes() for path in two} == two
    assert (tmp_path / "dangling").is_symlink()
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "a.csv").stat().st_mode & 0o777 == 0o640
    assert len(list(tmp_path.iterdir())) == 4


@pytest.mark.parametrize("fault", ["a full disk", "the first cannot be replaced", "a last look"])
def test_nothing_half_written(tmp_path, two, monkeypatch, fault):
    """A disk that fills up while the second file is written; what a last look raises."""
    synced = iter([False])

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    if fault == "a last look":
        with pytest.raises(KeyError):
            write_files(two, lambda: {}["changed meanwhile"])
    else:
        name = "b.csv" if fault == "a full disk" else "a.csv"
        if name == "b.csv":
            monkeypatch.setattr(disk.os, "fsync", lambda _: full() if next(synced, True) else None)
        else:
            monkeypatch.setattr("pathlib.Path.replace", full)
        found = complaints(write_files, two)
        the_only(found, name, None, None, None, "a file that can be written (No space left on device)")
    assert [path.read_bytes() for path in two] == [b"old", b"old"]
    assert sorted(tmp_path.iterdir()) == list(two)


def test_what_cannot_be_written(tmp_path, two):
    (tmp_path / "folder").mkdir()
    (tmp_path / "circle").symlink_to("circle")
    for name, words in (
        ("none/c.csv", "No such file or directory"),
        ("folder", "it is a folder"),
        ("circle", "its links go in a circle"),
    ):
        found = complaints(write_files, {**two, tmp_path / name: b"new"})
        the_only(found, name.rpartition("/")[2], None, None, None, f"a file that can be written ({words})")
        assert [path.read_bytes() for path in two] == [b"old", b"old"]


def test_a_command_reads_a_file_once(two):
    path = next(iter(two))
    with each_file_once() as asked:
        assert file_content(path) == b"old"
        path.write_bytes(b"new")
        assert file_content(path) == b"old"
        assert sha256(path) == hashlib.sha256(b"old").hexdigest()
        with each_file_once({path: b"held"}) as inner:
            assert file_content(path) == b"held"
    assert (list(asked), list(inner)) == ([path], [path])
    assert file_content(path) == b"new"
    assert sha256(path) == hashlib.sha256(b"new").hexdigest()
