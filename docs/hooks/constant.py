"""What a constant decides: any command of aesi with a constant of a module at another value.

    python docs/hooks/constant.py aesi.physics.initial_state:REST_C_RATE=0.04 bench start

Several may be given before the command. Every module that has imported the constant by name gets the value too, also
in the processes of `--set workers=2`, and what was kept with other values is not taken up. Not reached are constants
that compiled functions have taken in, what a module computed from one when it was imported, and workers of Dask.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Any

GIVEN = "AESI_CONSTANTS"
"""Variable of the environment by which processes that start anew hear of them."""


def replaced(module_name: str, name: str, value: float) -> Any:
    """Set the constant wherever it was imported; returns what it was.

    Raises AttributeError for a module without it.
    """
    module = import_module(module_name)
    was = getattr(module, name)
    for other in [m for key, m in sys.modules.items() if key.split(".")[0] in ("aesi", "flows")]:
        if getattr(other, name, None) is was:
            setattr(other, name, type(was)(value))
    return was


def replace(given: list[str]) -> list[str]:
    """Replace constants, each `MODULE:NAME=VALUE`, and mark the program as another one; returns what each was."""
    from aesi.numerics.files import source_digest

    told = []
    for one in given:
        place, value = one.split("=")
        module, name = place.split(":")
        told.append(f"{place}: {replaced(module, name, float(value)):g} -> {value}")
    source_digest.ALTERED += given
    return told


def main(arguments: list[str]) -> None:
    """Replace the constants that are named first, then run the command."""
    given = []
    while arguments and ":" in arguments[0] and "=" in arguments[0]:
        given.append(arguments.pop(0))
    os.environ[GIVEN] = " ".join(given)
    for line in replace(given):
        print(line, file=sys.stderr)
    from flows.cli import main as run

    sys.argv = ["aesi", *arguments]
    run()


if __name__ == "__mp_main__":  # as a process that starts anew imports this file, before it does anything
    replace(os.environ[GIVEN].split())
if __name__ == "__main__":
    main(sys.argv[1:])
