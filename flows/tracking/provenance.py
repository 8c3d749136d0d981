"""What a tracked result came from: versions, commit, and whether the tree had changes."""

from __future__ import annotations

import platform
import subprocess
from functools import cache
from importlib.metadata import version
from pathlib import Path

VERSIONS = ("aesi", "numpy", "scipy", "scikit-learn", "optuna", "mlflow", "prefect", "quantile-forest")


@cache
def versions() -> str:
    """The versions a result depends on, as one readable parameter."""
    return ", ".join(
        [f"python {platform.python_version()}", *(f"{name} {version(name)}" for name in VERSIONS)]
    )


@cache
def source_tags() -> dict[str, str]:
    """Git commit of the code in use, and whether the tree had changes; empty outside a repository."""
    root = Path(__file__).resolve().parents[2]

    def git(*arguments: str) -> str:
        done = subprocess.run(
            ["git", "-C", str(root), *arguments], capture_output=True, text=True, timeout=20, check=True
        )
        return done.stdout.strip()

    tags = {"mlflow.source.name": "aesi", "mlflow.source.type": "PROJECT"}
    try:
        tags["mlflow.source.git.commit"] = git("rev-parse", "HEAD")
        tags["aesi.dirty"] = str(bool(git("status", "--porcelain", "--untracked-files=no"))).lower()
    except (OSError, subprocess.SubprocessError):
        tags["aesi.dirty"] = "unknown"
    return tags
