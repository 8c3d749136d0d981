"""The folder in which the package keeps what can be made again."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path:
    """AESI_CACHE where that is set, else the user's cache folder of the platform; not created here."""
    chosen = os.environ.get("AESI_CACHE")
    if chosen:
        return Path(chosen).expanduser()
    import pooch

    return Path(pooch.os_cache("aesi"))
