"""Public data sets: found on disk, fetched from a server on this machine, refused in one sentence."""

import errno
import functools
import hashlib
import http.server
import os
import threading
from dataclasses import replace

import numpy as np
import pytest

from aesi.data import catalogue, read_measurement
from aesi.data.fetch import Remote
from aesi.errors import DataAway, DataError

RAW = "Time [s],I[A],U[V]\n" + "".join(
    f"{k},{i},{3.7 + 0.01 * i}\n" for k, i in enumerate([0.0, -5.0, 2.0, -4.0, 1.0, -5.0, 0.0])
)


@pytest.fixture(autouse=True)
def nowhere(tmp_path, monkeypatch):
    """No folder of data is named, and the cache is empty."""
    monkeypatch.delenv("AESI_DATA", raising=False)
    monkeypatch.setenv("AESI_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def server(tmp_path, monkeypatch):
    """A server on loopback with one measurement and one cell file; the catalogue points to it."""
    folder = tmp_path / "served"
    folder.mkdir()
    (folder / "raw.csv").write_text(RAW)
    (folder / "cell.json").write_text("{}")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *arguments):
            pass

    httpd = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
    threading.Thread(target=httpd.serve_forever, args=(0.01,), daemon=True).start()
    base = f"http://127.0.0.1:{httpd.server_port}/"

    def remote(name, path, columns):
        sha256 = hashlib.sha256((folder / path).read_bytes()).hexdigest()
        return Remote(name, base + path, sha256, columns, "charge-positive")

    files = (
        remote("drive.csv", "raw.csv", catalogue.ABOUT_ENERGY_COLUMNS),
        remote("cell.bpx.json", "cell.json", None),
    )
    first, *others = catalogue.SETS
    monkeypatch.setattr(catalogue, "SETS", (replace(first, files=files), *others))
    yield folder
    httpd.shutdown()
    httpd.server_close()


def test_a_set_is_fetched_checked_and_converted(server):
    path = catalogue.locate("about_energy_nmc", "drive")
    record = read_measurement(path)
    np.testing.assert_array_equal(record.current_a, [0.0, 5.0, -2.0, 4.0, -1.0, 5.0, 0.0])
    assert catalogue.locate("about_energy_nmc", "cell").read_text() == "{}"
    assert sorted(p.name for p in path.parent.iterdir()) == ["cell.bpx.json", "drive.csv"]


def test_a_set_fetched_once_needs_no_network(server):
    folder = catalogue.get("about_energy_nmc")
    (server / "raw.csv").unlink()
    assert catalogue.get("about_energy_nmc") == folder


def test_another_content_is_not_kept(server):
    (server / "raw.csv").write_text(RAW + "7,0.0,3.7\n")
    with pytest.raises(DataError, match="SHA-256"):
        catalogue.get("about_energy_nmc")
    with pytest.raises(DataError, match="SHA-256"):
        catalogue.locate("about_energy_nmc", "drive")


def test_a_server_that_answers_with_an_error_is_one_sentence(server):
    (server / "raw.csv").unlink()
    with pytest.raises(DataError, match="cannot be fetched"):
        catalogue.get("about_energy_nmc")


def test_no_network_is_one_sentence(monkeypatch):
    first, *others = catalogue.SETS
    dead = tuple(replace(r, url="http://127.0.0.1:9/nothing") for r in first.files)
    monkeypatch.setattr(catalogue, "SETS", (replace(first, files=dead), *others))
    with pytest.raises(DataError, match="connect to the network") as caught:
        catalogue.get("about_energy_nmc")
    assert "AESI_DATA" in str(caught.value)


def test_a_disk_that_is_full_was_taken_for_no_network(server, tmp_path, monkeypatch):
    def full(downloader, url, output_file, *more, **options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(output_file))

    monkeypatch.setattr("pooch.HTTPDownloader.__call__", full)
    with pytest.raises(DataError, match=r"drive\.csv cannot be written: No space left on device\.") as caught:
        catalogue.get("about_energy_nmc")
    assert not isinstance(caught.value, DataAway)


@pytest.mark.parametrize("name", ["about_energy_nmc", "lg_m50t_w8"])
def test_a_folder_that_was_named_in_vain_was_asked_for_again(tmp_path, monkeypatch, name):
    first, *others = catalogue.SETS
    dead = (replace(first.files[0], url="http://127.0.0.1:9/nothing"),)
    monkeypatch.setattr(catalogue, "SETS", (replace(first, files=dead), *others))
    monkeypatch.setenv("AESI_DATA", str(tmp_path / "typo"))
    with pytest.raises(DataError, match=f"AESI_DATA names {tmp_path}/typo, which is no folder"):
        catalogue.get(name)
    (tmp_path / "typo").mkdir()
    with pytest.raises(DataError, match=f"AESI_DATA names .*typo, which has no folder {name} with"):
        catalogue.get(name)


@pytest.mark.parametrize("below", ["", "measured"])
def test_a_copy_on_disk_goes_first(tmp_path, monkeypatch, below):
    folder = tmp_path / "mine" / below / "lg_18650hg2"
    folder.mkdir(parents=True)
    (folder / "us06.csv.gz").write_bytes(b"x")
    monkeypatch.setenv("AESI_DATA", str(tmp_path / "mine"))
    assert catalogue.locate("lg_18650hg2", "us06") == folder / "us06.csv.gz"
    assert any(str(folder) in line for line in catalogue.catalogue_lines())


def test_only_a_folder_that_is_named_is_looked_into(tmp_path, monkeypatch):
    beside = tmp_path / "data" / "measured" / "lg_m50t_w8"
    beside.mkdir(parents=True)
    (beside / "udds.csv").write_text("x")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DataError, match="cannot be fetched"):
        catalogue.get("lg_m50t_w8")
    monkeypatch.setenv("AESI_DATA", "data")
    assert catalogue.locate("lg_m50t_w8", "udds.csv").resolve() == beside / "udds.csv"


def test_a_folder_with_files_missing_does_not_count(tmp_path, monkeypatch, server):
    folder = tmp_path / "mine" / "about_energy_nmc"
    folder.mkdir(parents=True)
    (folder / "drive.csv").write_text("x")
    monkeypatch.setenv("AESI_DATA", str(tmp_path / "mine"))
    assert catalogue.get("about_energy_nmc") != folder


def test_sets_behind_a_page_say_where_and_how():
    with pytest.raises(DataError, match=r"10\.17632/cp3473x7xv\.3"):
        catalogue.get("lg_18650hg2")


def test_unknown_names_are_refused_with_what_there_is(tmp_path, monkeypatch):
    with pytest.raises(DataError, match="about_energy_nmc"):
        catalogue.get("about_energy")
    folder = tmp_path / "mine" / "lg_m50t_w8"
    folder.mkdir(parents=True)
    (folder / "udds.csv").write_text("x")
    monkeypatch.setenv("AESI_DATA", str(tmp_path / "mine"))
    with pytest.raises(DataError, match=r"udds\.csv"):
        catalogue.locate("lg_m50t_w8", "us06")
    with pytest.raises(DataError, match="name alone"):
        catalogue.locate("lg_m50t_w8", "../lg_m50t_w8/udds")


def test_a_set_is_copied_where_asked(tmp_path, server):
    catalogue.get("about_energy_nmc")
    out = catalogue.get("about_energy_nmc", tmp_path / "out")
    assert sorted(p.name for p in out.iterdir()) == ["cell.bpx.json", "drive.csv"]


def test_a_shared_folder_above_the_working_one_is_looked_into(tmp_path, monkeypatch):
    folder = tmp_path / "shared" / "data" / "measured" / "lg_m50t_w8"
    folder.mkdir(parents=True)
    (folder / "udds.csv").write_text(RAW)
    project = tmp_path / "group" / "project"
    project.mkdir(parents=True)
    monkeypatch.chdir(project)
    assert catalogue.locate("lg_m50t_w8", "udds") == folder / "udds.csv"


def test_a_set_that_is_in_the_folder_already_stays_there(tmp_path, monkeypatch):
    folder = tmp_path / "lg_m50t_w8"
    folder.mkdir()
    (folder / "udds.csv").write_text("x")
    monkeypatch.setenv("AESI_DATA", str(tmp_path))
    assert catalogue.get("lg_m50t_w8", folder) == folder
    assert (folder / "udds.csv").read_text() == "x"


def test_a_set_that_was_copied_into_itself_lost_files_of_its_own(tmp_path, monkeypatch):
    folder = tmp_path / "lg_m50t_w8"
    (folder / "below").mkdir(parents=True)
    for name in ("udds.csv", "below/udds.csv"):
        (folder / name).write_text(name)
    monkeypatch.setenv("AESI_DATA", str(tmp_path))
    with pytest.raises(DataError, match=r"lies in .*, from where the set is copied"):
        catalogue.get("lg_m50t_w8", folder / "below")
    assert (folder / "below" / "udds.csv").read_text() == "below/udds.csv"


def test_a_place_that_no_file_can_be_copied_to_was_refused_for_none(tmp_path, monkeypatch):
    """The symptom: "OUT cannot be written: None.", since Python has no number for this error."""
    folder, out = tmp_path / "lg_m50t_w8", tmp_path / "out"
    folder.mkdir()
    (folder / "udds.csv").write_text("x")
    out.mkdir()
    os.mkfifo(out / "udds.csv")
    monkeypatch.setenv("AESI_DATA", str(tmp_path))
    with pytest.raises(DataError, match=r"out cannot be written: .*udds.csv.* is a named pipe"):
        catalogue.get("lg_m50t_w8", out)
