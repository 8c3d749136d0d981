"""Ctrl-C ends a command soon, whatever it is busy with, and takes its children along."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

BUSY = """
import subprocess, sys, time
from flows.base.interrupt import ending_soon_on_interrupt
deaf = "import signal, time; signal.signal(2, signal.SIG_IGN); print(flush=True); time.sleep(60)"
child = subprocess.Popen([sys.executable, "-c", deaf], stdout=subprocess.PIPE)
child.stdout.readline()
with ending_soon_on_interrupt():
    try:
        print(child.pid, flush=True)
        time.sleep(60)
    finally:
        open(sys.argv[1], "w").close()
        {closing}
"""


CLOSINGS = {
    "a tidy end": "pass",
    "an end that hangs": "time.sleep(60)",
    "an end that loses its child": "child.stdout.read(); print('lost', file=sys.stderr, flush=True); time.sleep(60)",
}


@pytest.mark.parametrize("closing", CLOSINGS.values(), ids=CLOSINGS)
def test_it_ends_within_seconds_with_its_children(closing, tmp_path):
    busy = subprocess.Popen(
        [sys.executable, "-c", BUSY.format(closing=closing), str(tmp_path / "closing")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    child = psutil.Process(int(busy.stdout.readline()))
    started = time.monotonic()
    os.killpg(busy.pid, signal.SIGINT)
    out, err = busy.communicate(timeout=30)
    assert busy.returncode == 130
    assert time.monotonic() - started < 10  # 2 s on a machine that does nothing else
    assert out == ""
    assert (tmp_path / "closing").exists()
    assert err == "Interrupted.\n"
    assert not child.is_running() or child.status() == psutil.STATUS_ZOMBIE
