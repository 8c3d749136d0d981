"""`aesi bench real`: goes on where it was interrupted, and its report is of all cases."""


def test_a_case_that_was_judged_is_not_judged_again(tracked, monkeypatch):
    from aesi.bench.real import plan
    from flows.benchmarks import real

    monkeypatch.setenv("AESI_DATA", str(tracked))
    monkeypatch.setenv("AESI_CACHE", str(tracked / "cache"))
    first, second = (case for case in plan() if case.group == "witness")
    keep = tracked / "kept"
    row = {
        "case": first.name,
        "group": "witness",
        "development": True,
        "put_in": "",
        "answer": [],
        "matched": None,
    }
    row |= {
        "verdict": "none",
        "effects": [],
        "named": True,
        "processor_s": 2.0,
        "ours_s": 3.0,
        "source": "eis",
    }
    with monkeypatch.context() as before:
        before.setattr(real, "judged", lambda case, cells, limit_s: row)
        list(real.run(only=first.name, keep=str(keep)))
    lines = list(real.run(only="witness", keep=str(keep), report=str(tracked / "real.html")))
    assert {line["case"]: line["verdict"] for line in lines[:-1]} == {
        first.name: "none",
        second.name: "not run",
    }
    assert lines[-1]["not_run"] == [second.name]
    assert first.name in (tracked / "real.html").read_text()
