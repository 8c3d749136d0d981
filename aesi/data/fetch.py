"""One file from its public address: downloaded, checked by its checksum, converted, put in place whole."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from aesi.data.convert import write_csv
from aesi.data.read import Reading, Sign, read
from aesi.errors import DataAway, DataError, not_written

TIMEOUT_S = 30
"""Seconds after which a server counts as not answering."""


@dataclass(frozen=True)
class Remote:
    """A file at an address.

    name : local file name.  sha256 : checksum of the file at the address.  columns, sign : how to read a measurement
    that is converted to this project's columns; without columns the file is kept as it is.
    """

    name: str
    url: str
    sha256: str
    columns: Mapping[str, str | None] | None = None
    sign: Sign = "discharge-positive"


def fetch(remote: Remote, folder: Path) -> Path:
    """Path of the file in the folder, after download, check and conversion.

    Raises DataError, one sentence, where there is no network, the address answers with an error, the content
    has another checksum, or the folder cannot be written.
    """
    target = folder / remote.name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".part-") as part:
            raw = _download(remote, Path(part))
            ready = Path(part) / f"ready-{remote.name}"
            if remote.columns is None:
                shutil.copyfile(raw, ready)
            else:
                record = read(raw, Reading(remote.columns, sign=remote.sign), max_rows=None)
                write_csv(ready, record.to_frame())
            os.replace(ready, target)
    except OSError as error:
        raise DataError(not_written(target, error)) from None
    return target


def _download(remote: Remote, folder: Path) -> Path:
    """Path of the file as it is at its address, below the folder.

    Raises DataError for another content, DataAway where the address cannot be reached or answers with an error, OSError
    where the folder cannot take the file.
    """
    import logging

    import pooch
    from requests import RequestException

    pooch.get_logger().setLevel(logging.WARNING)
    try:
        return Path(
            pooch.retrieve(
                remote.url,
                known_hash=f"sha256:{remote.sha256}",
                fname=f"raw-{remote.name}",
                path=folder,
                downloader=pooch.HTTPDownloader(timeout=TIMEOUT_S),
            )
        )
    except ValueError:
        raise DataError(
            f"{remote.url} holds another file than expected (its SHA-256 is not {remote.sha256[:12]}...); "
            "it was not kept."
        ) from None
    except (RequestException, ConnectionError, TimeoutError) as error:
        raise DataAway(
            f"{remote.name} cannot be fetched from {remote.url} ({type(error).__name__}): connect to the network "
            "and try again, or set AESI_DATA to a folder that holds the data set.",
        ) from None
