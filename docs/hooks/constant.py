"""What a constant decides: any command of aesi with a constant of a module at another value.

    python docs/hooks/constant.py aesi.physics.initial_state:REST_C_RATE=0.04 bench start

Several may be given before the command. Every module that has imported the constant by name gets the value too. Not
reached are constants that compiled functions have taken in, and what a module computed from one when it was imported.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any


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


def main(arguments: list[str]) -> None:
    """Replace the constants that are named first, then run the command."""
    while arguments and ":" in arguments[0] and "=" in arguments[0]:
        place, value = arguments.pop(0).split("=")
        module, name = place.split(":")
        print(f"{place}: {replaced(module, name, float(value)):g} -> {value}", file=sys.stderr)
    from flows.cli import main as run

    sys.argv = ["aesi", *arguments]
    run()


if __name__ == "__main__":
    main(sys.argv[1:])
