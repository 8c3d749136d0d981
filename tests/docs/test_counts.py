"""What the pages say in words of the findings on measured cells is what the tables of the benchmarks hold."""

import re
from pathlib import Path
from statistics import median

import pytest

ROOT = Path(__file__).resolve().parents[2]
BENCHMARKS = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
PAGES = ("README.md", "docs/index.md", "docs/limits.md", "docs/benchmarks.md")


def cases(name):
    """Rows of the table of each case, by column, of one table of the benchmarks."""
    table = BENCHMARKS.split(f"<!-- table of {name} -->")[1].split("<!-- end of")[0]
    lines = [line.strip() for line in table.split('"Each case"')[-1].splitlines()]
    cells = [[cell.strip() for cell in line[1:-1].split("|")] for line in lines if line.startswith("|")]
    return [dict(zip(cells[0], row, strict=True)) for row in cells[2:]]


def text_of(page):
    """A page without its breaks of lines and marks of emphasis."""
    return re.sub(r"[*`]", "", re.sub(r"\s+", " ", (ROOT / page).read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def withheld():
    return [row for row in cases("aesi bench real, archive") if row["about"] == "temperature withheld"]


def errors(rows):
    return [[float(row[name]) for row in rows] for name in ("declared, mV", "recalibrated", "as written")]


@pytest.mark.parametrize("page", PAGES)
def test_how_often_a_written_model_is_more_accurate_than_recalibration_alone(withheld, page):
    declared, refitted, written = errors(withheld)
    better = sum(one < other for one, other in zip(written, refitted, strict=True))
    said = text_of(page)
    assert re.search(rf"more accurate than recalibration alone (\| )?on {better}\b", said)
    for figure in (median(written), median(refitted), median(declared)):
        assert re.search(rf"\b{figure:.0f}\b", said)
    if page in PAGES[2:]:
        worse = sum(one > 1.05 * other for one, other in zip(written, refitted, strict=True))
        than_declared = sum(one > other for one, other in zip(written, declared, strict=True))
        assert f"more than 5 % worse on {worse}" in said
        assert f"worse than the declared model on {than_declared}" in said


@pytest.mark.parametrize("page", PAGES)
def test_how_far_off_a_withheld_temperature_is_named(withheld, page):
    found = [re.fullmatch(r"(\S+) \[(\S+), (\S+)\]", row["found"]) for row in withheld]
    assert all(found)
    sizes = [[float(size) for size in each.groups()] for each in found]
    true = [float(row["true"]) for row in withheld]
    off = [abs(size - there) for (size, *_), there in zip(sizes, true, strict=True)]
    inside = sum(low <= there <= high for (_, low, high), there in zip(sizes, true, strict=True))
    half = [(high - low) / 2 for _, low, high in sizes]
    said = text_of(page)
    assert re.search(
        rf"{round(median(off), 6):.1f} K (off )?in the median(,| and) {max(off):.0f} at worst", said
    )
    assert re.search(
        rf"\b{inside} within (the interval of )?\+/- {min(half):.0f} to {max(half):.0f} K \(90 %\)", said
    )


@pytest.mark.parametrize("page", PAGES)
def test_how_often_a_measured_cell_by_itself_is_unknown(page):
    rows = cases("aesi bench real") + cases("aesi bench real, archive")
    alone = [row["verdict"] for row in rows if row["declared, mV"]]
    beside = [row["verdict"].split(":")[0] for row in rows if not row["declared, mV"]]
    alone += [row["verdict"] for row in cases("aesi bench left_out")]
    assert {verdict.split(":")[0] for verdict in alone} == {"unknown"}
    said = text_of(page)
    assert re.search(rf"\b{len(alone)}\b", said)
    told = re.search(r"(\d+) (?:of \d+ )?(?:are |were )?found(?:,| and) (\d+) none", said)
    assert told
    assert [int(told[1]), int(told[2])] == [beside.count("found"), beside.count("none")]


@pytest.mark.parametrize("page", PAGES[:3])
def test_how_often_a_verdict_beside_a_known_good_record_is_right(page):
    """They were told as how often each was given, which reads as how often it is right."""
    rows = cases("aesi bench real") + cases("aesi bench real, archive")
    beside = [row for row in rows if not row["declared, mV"]]
    right = [
        sum(row["verdict"].startswith(verdict) and row["right"] == "yes" for row in beside)
        for verdict in ("found", "none")
    ]
    wrong = [row["about"] for row in beside if row["verdict"] == "none" and row["right"] == "no"]
    said = text_of(page)
    told = re.search(r"\b(\d+) (?:of \d+|of these) found(?:,|\.| and) (\d+) (?:of \d+|of these) none", said)
    assert told
    assert [int(told[1]), int(told[2])] == right
    sizes = {"current gain": [], "voltage offset": [], "voltage lag": []}
    for about in wrong:
        kind, _, size = about.rpartition(" ")
        sizes[kind].append(float(size))
    gains, offsets, lags = sizes.values()
    assert (
        f"a current gain of {100 * (min(gains) - 1):.0f} to {100 * (max(gains) - 1):.0f} %, a voltage offset of "
        f"{1e3 * min(offsets):.0f} to {1e3 * max(offsets):.0f} mV or a lag of {lags[0]:g} s" in said
    )


@pytest.mark.parametrize("page", PAGES[:3])
def test_how_often_a_name_that_is_no_temperature_is_right(page):
    rows = cases("aesi bench real") + cases("aesi bench real, archive")
    named = [row for row in rows if row["declared, mV"] and ":" in row["verdict"]]
    others = [row["right"] == "yes" for row in named if "ambient_temperature" not in row["verdict"]]
    assert f"{sum(others)} of {len(others)}" in text_of(page)
    assert all(row["right"] == "yes" for row in named if "ambient_temperature" in row["verdict"])
    before = [row for row in cases("aesi bench real") if row["about"].startswith("temperature withheld")]
    found = sum(row["right"] == "yes" for row in before)
    assert f"{found} of {len(before)} records before" in text_of(page)


@pytest.mark.parametrize("page", PAGES[1:])
def test_how_often_several_unaltered_records_of_a_cell_get_a_name(page):
    verdicts = [row["verdict"] for row in cases("aesi bench left_out")]
    named = sum(":" in verdict for verdict in verdicts)
    said = text_of(page)
    assert f"together {named} of {len(verdicts)}" in said or f"In {named} of them an effect is named" in said
