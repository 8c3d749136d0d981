"""The command line under absurd arguments and files: a result, or exit code 1 or 2 and a sentence."""

import gzip
import os
import shutil

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

QUICK = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=list(HealthCheck),
    database=None,
    phases=(Phase.explicit, Phase.generate),  # a smaller example tells little more, and takes minutes to find
)
THOROUGH = settings(QUICK, max_examples=10_000)

NUMBERS = ["0.5", "0", "1", "-1", "2", "nan", "inf", "1e308", "", "x", "０.5", "1_0"]
JUNK = {
    "empty.csv": b"",
    "head.csv": b"time_s,current_a,voltage_v\n",
    "cut.csv": b"time_s,current_a,voltage_v\n0,1,3.7\n1,1,3.",
    "back.csv": b"time_s,current_a,voltage_v\n0,1,3.7\n2,1,3.7\n1,1,3.7\n",
    "huge.csv": b"time_s,current_a,voltage_v\n0,1e300,3.7\n1,1e300,3.7\n2,-1e300,3.7\n",
    "nan.csv": b"time_s,current_a,voltage_v\n0,nan,3.7\n1,1,inf\n",
    "binary.csv": bytes(range(256)) * 8,
    "broken.csv.gz": gzip.compress(b"time_s,current_a\n0,1\n")[:-6],
    "wide.csv": b"time_s,current_a,voltage_v\n" + b",".join([b"1"] * 5000) + b"\n",
    "null.json": b"null",
    "list.json": b"[1, 2",
    "deep.json": b"[" * 5000 + b"]" * 5000,
    "other.json": b'{"Header": {"BPX": 1.0}, "Parameterisation": {}}',
    "empty.yaml": b"",
    "list.yaml": b"- 1\n- 2\n",
    "bomb.yaml": b"a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n",
    "python.yaml": b"name: !!python/object/apply:os.getcwd []\n",
    "tabs.yaml": b"name:\tx\n\t- y\n",
    "number.parquet": b"PAR1\x00\x00PAR1",
}


@pytest.fixture
def place(tmp_path, cell, monkeypatch):
    """A folder with good and bad files; the names of all of them and of some that are not there."""
    for name, content in JUNK.items():
        (tmp_path / name).write_bytes(content)
    time_s = np.arange(0.0, 60.0)
    table = pd.DataFrame({"time_s": time_s, "current_a": 10 * np.sin(time_s), "voltage_v": 3.7})
    table.to_csv(tmp_path / "good.csv", index=False)
    shutil.copy(cell, tmp_path / "good.json")
    (tmp_path / "folder").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


FILES = st.sampled_from(
    [*JUNK, "good.csv", "good.json", "folder", "missing.csv", "", ".", "/dev/null", "a\nb", "é" * 90]
)
BAD_FILES = st.sampled_from([*JUNK, "good.json", "folder", "missing.csv", "", "/dev/null"])
EFFECTS = [
    "series_resistance",
    "series_resistance:resistance_ohm=1e-3",
    "series_resistance:x=",
    "self_heating",
]
WORDS = st.sampled_from([*EFFECTS, ":", "=", "a=b", "linear"]) | st.text(max_size=6)
OUTPUTS = [
    "o.csv",
    "missing/o.csv",
    "folder",
    "",
    ".",
    "/dev/null/o.csv",
    "/dev/null",
    "good.csv/o.csv",
    "a\nb",
    "é" * 90,
]


def option(name, values):
    return st.one_of(st.just([]), values.map(lambda value: [name, value]))


def command(name, *parts):
    return st.tuples(*parts).map(lambda found: [name, *(word for part in found for word in part)])


MAPPING = (option("--column", WORDS), option("--sign", WORDS), option("--soc0", st.sampled_from(NUMBERS)))
ARGUMENTS = st.one_of(
    command(
        "simulate",
        option("--cell", FILES),
        option("--current", FILES),
        option("--out", st.sampled_from(OUTPUTS)),
        option("--effect", WORDS),
        option("--hold", WORDS),
        *MAPPING,
    ),
    command("predict", option("--model", FILES), option("--current", FILES), st.just(["--out", "p.csv"]), *MAPPING),
    command("calibrate", option("--cell", FILES), option("--data", BAD_FILES), st.just(["--out", "c.json"]), *MAPPING),
    command(
        "discover",
        option("--cell", FILES),
        option("--data", BAD_FILES),
        option("--holdout", st.sampled_from(NUMBERS)),
        option("--max-effects", st.sampled_from(NUMBERS)),
        st.just(["--out", "d"]),
        *MAPPING,
    ),
    command("run", BAD_FILES.map(lambda name: [name]), option("--set", WORDS), st.just(["--no-prefect"])),
    command("worker", BAD_FILES.map(lambda name: [name]), option("--set", WORDS)),
    command("effects", WORDS.map(lambda word: [word]), option("--effect-file", BAD_FILES)),
    command("bench", st.just(["espm"]), option("--compare", BAD_FILES), st.just(["--set", "no equals sign"])),
    st.lists(st.sampled_from(["run", "data", "list", "--help", "--", "-h", "--version"]) | WORDS, max_size=5),
)  # fmt: skip


def check(call, arguments):
    if arguments[:1] in (["ui"], ["tables"]):
        return
    code, out, err = call(*arguments)
    assert code in (0, 1, 2), (arguments, err)
    assert "Traceback" not in out + err, arguments
    assert "aesi: unexpected" not in err, (arguments, err)
    if code:
        assert err.strip(), arguments
    elif arguments[:1] == ["simulate"] and os.path.isfile("o.csv"):
        assert np.isfinite(pd.read_csv("o.csv")["voltage_v"]).all(), arguments
        os.unlink("o.csv")


@QUICK
@given(ARGUMENTS)
def test_absurd_arguments_end_in_one_sentence(call, place, arguments):
    check(call, arguments)


@pytest.mark.slow
@THOROUGH
@given(ARGUMENTS)
def test_ten_thousand_absurd_arguments_end_in_one_sentence(call, place, arguments):
    check(call, arguments)
