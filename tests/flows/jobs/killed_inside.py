"""Runs `aesi` and kills it, without a chance to clean up, inside the n-th call of a function.

    python killed_inside.py MODULE NAME[.NAME] N ARGUMENT...

The function has done its work when the process dies, and nobody has seen the result. Worker processes are spared.
"""

import os
import signal
import sys
from importlib import import_module


def arm(module: str, name: str, call: int) -> None:
    holder, *inner = import_module(module), *name.split(".")
    for part in inner[:-1]:
        holder = getattr(holder, part)
    work, me, calls = getattr(holder, inner[-1]), os.getpid(), 0

    def deadly(*arguments, **options):
        nonlocal calls
        result = work(*arguments, **options)
        calls += os.getpid() == me
        if calls == call and os.getpid() == me:
            os.kill(me, signal.SIGKILL)
        return result

    setattr(holder, inner[-1], deadly)


if __name__ == "__main__":
    from flows import cli
    from flows.base import environment

    environment.prepare_process()
    arm(sys.argv[1], sys.argv[2], int(sys.argv[3]))
    sys.argv[1:] = sys.argv[4:]
    cli.main()
