"""A file is there whole or not at all, for everybody who may read it."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from aesi.numerics.files.whole import check_writable, write_whole


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
    finally:
        os.umask(before)
    assert (tmp_path / "shared").stat().st_mode & 0o777 == 0o640


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


@pytest.mark.skipif(not Path("/dev/stdout").exists(), reason="this system has no /dev/stdout")
def test_a_pipe_behind_dev_stdout_had_no_name_to_write_to():
    code = "from pathlib import Path; from aesi.numerics.files.whole import write_whole; "
    command = [sys.executable, "-c", code + "write_whole(Path('/dev/stdout'), 'a')"]
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout == "a", done.stderr


def test_a_place_is_tried_and_left_as_it_was(tmp_path):
    check_writable(tmp_path / "new" / "below" / "x.csv")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError) as refused:
        check_writable(tmp_path / "file" / "below" / "x.csv")
    assert refused.value.filename == str(tmp_path / "file")


def test_a_link_into_a_folder_that_is_not_there_cannot_be_written_to(tmp_path):
    link = tmp_path / "link.csv"
    link.symlink_to(tmp_path / "away" / "there.csv")
    for write in (check_writable, lambda path: write_whole(path, "x")):
        with pytest.raises(FileNotFoundError):
            write(link)
