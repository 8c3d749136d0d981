"""Provenance of a tracked result: versions, commit, and whether the tree had changes."""

from __future__ import annotations

import platform
import subprocess
from functools import cache
from importlib.metadata import version
from pathlib import Path

COMMIT = "mlflow.source.git.commit"
VERSIONS = ("aesi", "numpy", "scipy", "scikit-learn", "optuna", "mlflow", "prefect", "quantile-forest")


@cache
def versions() -> str:
    """The versions a result depends on, as one readable parameter."""
    return ", ".join(
        [f"python {platform.python_version()}", *(f"{name} {version(name)}" for name in VERSIONS)]
    )


@cache
def source_tags() -> dict[str, str]:
    """Git commit of the code in use, and whether the tree had changes; no commit where it is of no repository."""
    return {"mlflow.source.name": "aesi", "mlflow.source.type": "PROJECT"} | commit_tags(Path(__file__))


def commit_tags(file: Path) -> dict[str, str]:
    """The commit of the repository that a file is kept in.

    Packages are installed in folders of others' repositories, whose commits say nothing of them.
    """

    def git(*arguments: str) -> str:
        done = subprocess.run(
            ["git", "-C", str(file.resolve().parent), *arguments],
            capture_output=True,
            text=True,
            timeout=20,
            check=True,
        )
        return done.stdout.strip()

    try:
        git("ls-files", "--error-unmatch", file.name)
        commit = git("rev-parse", "HEAD")
        dirty = bool(git("status", "--porcelain", "--untracked-files=no"))
    except (OSError, subprocess.SubprocessError):
        return {"aesi.dirty": "unknown"}
    return {COMMIT: commit, "aesi.dirty": str(dirty).lower()}
