"""The address of the tracking store: which one is meant, and whether it can be one."""

from __future__ import annotations

import os
import re
from pathlib import Path
from urllib.parse import urlsplit

from aesi.errors import InputError
from aesi.logins import SERVERS, without_login
from flows.base import environment
from flows.base.databases import with_driver

SQLITE = "sqlite:///"
DATABASES = ("sqlite", "postgresql", "mysql", "mssql")
DATABRICKS = ("databricks", "databricks-uc", "uc")
"""Admissible schemes of an address, beside those of a server. Any other is a folder of files for MLflow, which takes no
new runs."""
MEANT_OTHERWISE = re.compile(r"%[0-9A-Fa-f]{2}|[?]")
"""Parts of a path that the address of a database has for other things: the file would be another."""
PLACE = "runs are tracked in the current folder, or in the one that AESI_HOME names"
"""Where runs are to be found that are not in the store that was opened."""


def default_uri() -> str:
    """MLFLOW_TRACKING_URI, or the SQLite file in the workspace."""
    return os.environ.get("MLFLOW_TRACKING_URI") or f"{SQLITE}{environment.workspace() / 'mlflow.db'}"


def checked_address(uri: str | None = None) -> str:
    """The address of a store as MLflow takes it; that of the workspace's where none is given.

    Raises InputError for what is no address of one.
    """
    uri = with_driver(uri or default_uri())
    scheme, _, rest = uri.partition("://")
    kind = scheme.partition("+")[0]
    if scheme in DATABRICKS or (kind in DATABASES[1:] and rest):
        return uri
    if not (uri.startswith(SQLITE) or (kind in SERVERS and _has_host(uri))):
        raise InputError(
            f"{without_login(uri)!r} is no address of a tracking store; give http://HOST:PORT, sqlite:///FILE or "
            "postgresql://USER@HOST/DATABASE as tracking.uri, --uri or MLFLOW_TRACKING_URI, or leave it out."
        )
    if kind == "sqlite" and MEANT_OTHERWISE.search(rest):
        raise InputError(
            f"{rest.removeprefix('/')} cannot hold a tracking store, since ? and % with two digits mean something else "
            f"in an address; give a path without them ({PLACE})."
        )
    return uri


def _has_host(uri: str) -> bool:
    try:
        split = urlsplit(uri)
        return bool(split.hostname) and (split.port is None or split.port > 0)
    except ValueError:  # a port that is no number
        return False


def database_file(uri: str) -> Path:
    """The file of a SQLite store."""
    return Path(uri.removeprefix(SQLITE)).expanduser().resolve()
