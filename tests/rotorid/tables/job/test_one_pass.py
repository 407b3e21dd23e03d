"""A job is read in one pass: what reads it enters each file of tables/job once and does not come back."""

from __future__ import annotations

import sys
from itertools import groupby
from pathlib import Path

import pytest
from cases import each_of

import rotorid.tables.job
from rotorid.samples import sample_data
from rotorid.tables import read_job
from rotorid.tables.job.job_as_written import JobSource
from rotorid.tables.job.workbook_writing import job_workbook_bytes

ROOM = str(Path(rotorid.tables.job.__file__).parent)
SAMPLES = ("turbo_job/checked", "turbo_job/holes", "model_job/job", "left_in/job", "bk_two_plane/job")


def stays(path):
    """Files of the room in the order in which their functions are called, a stay in one file once."""
    seen = []

    def note(frame, event, _):
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(ROOM) and not code.co_name.startswith("<"):
            seen.append(Path(code.co_filename).stem)

    before = sys.gettrace()
    sys.settrace(note)
    try:
        read_job(path)
    finally:
        sys.settrace(before)
    return [name for name, _ in groupby(seen)]


@each_of("sample", SAMPLES)
@pytest.mark.parametrize("kind", [".toml", ".xlsx"])
def test_each_file_is_entered_once(sample, kind, tmp_path):
    path = sample_data() / f"{sample}.toml"
    if kind == ".xlsx":
        book = tmp_path / "job.xlsx"
        book.write_bytes(job_workbook_bytes(read_job(path), JobSource((path,)), book))
        path = book
    found = stays(path)
    assert {"readings", "job_model", "job_planes", "job_limits", "job_holes"} <= set(found)
    assert len(found) == len(set(found)), found
