"""A SQLite store that was moved or copied together with its artifacts: its artifact locations follow it.

MLflow writes the absolute address of an experiment's artifacts into the database. Artifacts of this project lie
beside the database, in mlartifacts/<experiment>, so a database that lies beside such a folder and points
elsewhere was moved. The folder keeps its name where the experiment is given another one.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path
from urllib.parse import unquote

FOLDER = "mlartifacts"
HOLDERS = (
    ("runs", "artifact_uri"),
    ("logged_models", "artifact_location"),
    ("model_versions", "storage_location"),
    ("model_versions", "source"),
    ("experiments", "artifact_location"),
)
"""Tables and columns of MLflow's database that hold addresses of artifacts."""


def artifact_folder(home: Path, experiment: str) -> Path:
    """Where the artifacts of an experiment lie.  home : folder of the database, or the workspace where that is none."""
    return home / FOLDER / experiment


def follow(database: Path) -> tuple[str, ...]:
    """Point the artifacts of experiments that were moved with the database to where they are now.

    Returns a sentence for each such experiment. Experiments whose artifacts are not beside the database stay as
    they are.
    """
    if not database.exists():
        return ()
    connection = sqlite3.connect(database, timeout=30)
    try:
        with connection:
            return tuple(_moved(connection, database))
    finally:
        connection.close()


def _moved(connection: sqlite3.Connection, database: Path) -> list[str]:
    tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if "experiments" not in tables:
        return []
    said = []
    known = connection.execute("SELECT name, artifact_location FROM experiments").fetchall()
    for name, before in known:
        *_, above, own = ("", "", *(before or "").split("/"))
        if above != FOLDER or not own:
            continue  # the user's own place
        folder = artifact_folder(database.parent, unquote(own))
        now = folder.as_uri()
        if before in (now, str(folder)) or not folder.is_dir():
            continue
        for table, column in HOLDERS:
            if table in tables:
                connection.execute(
                    f"UPDATE {table} SET {column} = ? || substr({column}, ?) "
                    f"WHERE {column} = ? OR substr({column}, 1, ?) = ?",
                    (now, len(before) + 1, before, len(before) + 1, f"{before}/"),
                )
        said.append(
            f"tracking: the artifacts of {name} were moved with their store; they are read from {folder}."
        )
    return said
