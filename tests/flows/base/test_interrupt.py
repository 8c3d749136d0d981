"""Ctrl-C ends a command soon, whatever it is busy with, and takes its children along."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

WITH_US = os.environ | {"PYTHONPATH": str(Path(__file__).resolve().parents[3])}

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
    ended_by(signal.SIGINT, 130, closing, tmp_path)


def test_a_command_that_a_scheduler_ended_left_its_server_running(tmp_path):
    ended_by(signal.SIGTERM, 143, CLOSINGS["a tidy end"], tmp_path)


def ended_by(number, code, closing, tmp_path):
    busy = subprocess.Popen(
        [sys.executable, "-c", BUSY.format(closing=closing), str(tmp_path / "closing")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    child = psutil.Process(int(busy.stdout.readline()))
    started = time.monotonic()
    if number == signal.SIGINT:  # of a terminal: it reaches the whole group
        os.killpg(busy.pid, number)
    else:
        busy.send_signal(number)
    out, err = busy.communicate(timeout=30)
    assert busy.returncode == code
    assert time.monotonic() - started < 10  # 2 s on a machine that does nothing else
    assert out == ""
    assert (tmp_path / "closing").exists()
    assert err == "Interrupted.\n"
    assert not child.is_running() or child.status() == psutil.STATUS_ZOMBIE


TAKEN = """
import os, signal, sys
from flows.base.interrupt import ending_soon_on_interrupt, hearing_signals_again, kept_on_interrupt
class Theirs(BaseException): pass
def theirs(number, frame): raise Theirs
with ending_soon_on_interrupt():
    signal.signal(signal.SIGTERM, theirs)  # as a flow engine does
    with hearing_signals_again():
        pass
    assert signal.getsignal(signal.SIGTERM) is theirs
    with hearing_signals_again(), kept_on_interrupt("Go on."):
        os.kill(os.getpid(), signal.SIGTERM)
"""


def test_a_signal_that_a_library_has_taken_said_nothing_of_how_to_go_on():
    done = subprocess.run(
        [sys.executable, "-c", TAKEN], env=WITH_US, capture_output=True, text=True, check=False
    )
    assert done.returncode == 143
    assert done.stderr == "Stopped. Go on.\n"


STARTING = """
import time
from flows.base.interrupt import ending_soon_on_interrupt
from flows.evaluation.spread import in_processes
if __name__ == "__main__":
    with ending_soon_on_interrupt():
        print(list(in_processes(time.sleep, [60.0, 60.0], 2, lost=float)))
"""


def test_a_worker_that_was_still_importing_showed_its_traceback(tmp_path):
    script = tmp_path / "starting.py"
    script.write_text(STARTING)
    busy = subprocess.Popen(
        [sys.executable, str(script)], env=WITH_US, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    workers = []
    while len(workers) < 2:
        workers = [
            one for one in psutil.Process(busy.pid).children() if "spawn_main" in " ".join(one.cmdline())
        ]
        time.sleep(0.01)
    os.killpg(busy.pid, signal.SIGINT)
    _, err = busy.communicate(timeout=30)
    assert busy.returncode == 130
    assert err == "Interrupted.\n"
    assert not [one for one in workers if one.is_running() and one.status() != psutil.STATUS_ZOMBIE]


def test_an_interrupt_before_anything_hears_it_left_a_traceback():
    """Within the first fifth of a second, while the command is still being imported."""
    code = """
import sys
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == "typer":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupting())
import flows.cli
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "Interrupted.\n")
