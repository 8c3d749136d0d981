"""A file is there whole or not at all, for everybody who may read it."""

import os
import threading
from pathlib import Path

import pytest

from aesi.numerics.files.whole import READ_BY_OWNER, write_whole


def test_text_and_bytes_are_written_into_a_folder_that_is_made(tmp_path):
    write_whole(tmp_path / "new" / "text.json", "µ\n")
    write_whole(tmp_path / "new" / "bytes.bin", b"\x00\x01")
    assert (tmp_path / "new" / "text.json").read_bytes() == "µ\n".encode()
    assert (tmp_path / "new" / "bytes.bin").read_bytes() == b"\x00\x01"


def test_a_failed_write_leaves_the_old_file_and_no_litter(tmp_path, monkeypatch):
    path = tmp_path / "x"
    write_whole(path, b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such modes")
def test_what_is_written_can_be_read_as_any_other_file_of_the_user(tmp_path):
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "shared", "x")
        write_whole(tmp_path / "own", "x", READ_BY_OWNER)
    finally:
        os.umask(before)
    assert [(tmp_path / name).stat().st_mode & 0o777 for name in ("shared", "own")] == [0o640, 0o600]


def test_a_link_keeps_pointing_to_its_file(tmp_path):
    target, link = tmp_path / "there.csv", tmp_path / "link.csv"
    target.write_text("old")
    link.symlink_to(target)
    write_whole(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no named pipes")
def test_a_pipe_is_written_to_and_stays_one(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(Path(pipe).read_text()))
    reader.start()
    write_whole(pipe, "rows")
    reader.join(10)
    assert read == ["rows"]
    assert pipe.is_fifo()
