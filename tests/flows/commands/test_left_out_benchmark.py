"""`aesi bench left_out`: goes on where it was interrupted, and writes its table into a page."""

from flows.benchmarks import left_out


def test_a_record_that_was_left_out_before_is_not_judged_again_and_stands_in_the_table(tracked, monkeypatch):
    monkeypatch.setenv("AESI_DATA", str(tracked))
    monkeypatch.setenv("AESI_CACHE", str(tracked / "cache"))
    first, second, *_ = left_out.plan("lg_m50t")
    errors = {"before_mv": 10.0, "recalibrated_mv": 8.0, "after_mv": 12.0, "times_better": 1.5}
    row = {
        "case": first.name,
        "cell": first.set.data,
        "record": first.test,
        "verdict": "found",
        "effects": ["x"],
    }
    found = row | errors | {"processor_s": 2.0, "ours_s": 3.0}
    with monkeypatch.context() as before:
        before.setattr(left_out, "judged", lambda case, cells, limit_s: found)
        list(left_out.run(only=first.name, keep=str(tracked / "kept")))
    page = tracked / "page.md"
    page.write_text(f"before\n{left_out.BEGIN}\n{left_out.END}\nafter\n")
    lines = list(left_out.run(only="lg_m50t", keep=str(tracked / "kept"), write=str(page)))
    verdicts = {line["case"]: line["verdict"] for line in lines[:-1]}
    assert verdicts[first.name] == "found"
    assert verdicts[second.name] == "not run"
    assert (lines[-1]["cases"], lines[-1]["worst_times"]) == (1, 1.5)
    text = page.read_text()
    assert "| found: x | 10.0 | 8.0 | 12.0 | **1.50** |" in text
    assert text.startswith("before\n")
    assert text.endswith("\nafter\n")
