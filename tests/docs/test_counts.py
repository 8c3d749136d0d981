"""What the pages say in words of the findings on measured cells is what the tables of the benchmarks hold."""

import re
from pathlib import Path
from statistics import geometric_mean, median

import pytest

from aesi.bench.detectable import SEEN_NATS
from aesi.bench.real.plan import WARM
from aesi.bench.real.report import FIGURES
from aesi.bench.real.summary import NEAR_SHARE
from aesi.tracer.decide.model_to_write import AS_GOOD
from flows.benchmarks.history import read_history

ROOT = Path(__file__).resolve().parents[2]
MEASURED, LEFT_OUT = "docs/benchmarks/measured-cells.md", "docs/benchmarks/left-out-records.md"
FIRST = ("README.md", "docs/index.md", "docs/limits.md")
STATES = ("declared, mV", "recalibrated, mV", "as written, mV")
FAULTS = (["current", "offset"], ["current", "gain"], ["voltage", "offset"], ["voltage", "lag"])
BENCHMARKS = "".join(
    page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs" / "benchmarks").glob("*.md"))
)


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
    return [row for row in cases("aesi bench real, archive") if row["case"] == "temperature withheld"]


def errors(rows):
    return [[float(row[name]) for row in rows] for name in STATES]


@pytest.mark.parametrize("page", [*FIRST, MEASURED])
def test_how_often_a_written_model_is_more_accurate_than_recalibration_alone(withheld, page):
    declared, refitted, written = errors(withheld)
    better = sum(one < other for one, other in zip(written, refitted, strict=True))
    said = text_of(page)
    assert re.search(rf"more accurate than recalibration alone (\| )?on {better}\b", said)
    for figure in (median(written), median(refitted), median(declared)):
        assert re.search(rf"\b{figure:.0f}\b", said)
    if page in ("docs/limits.md", MEASURED):
        worse = sum(one > 1.05 * other for one, other in zip(written, refitted, strict=True))
        than_declared = sum(one > other for one, other in zip(written, declared, strict=True))
        assert f"more than 5 % worse on {worse}" in said
        assert f"worse than the declared model on {than_declared}" in said


@pytest.mark.parametrize("page", [*FIRST, MEASURED])
def test_how_far_off_a_withheld_temperature_is_named(withheld, page):
    named = [row for row in withheld if row["right"] == "yes"]
    found = [re.fullmatch(r"(\S+) \[(\S+), (\S+)\]", row["estimate"]) for row in named]
    assert all(found)
    sizes = [[float(size) for size in each.groups()] for each in found]
    true = [float(row["true size"]) for row in named]
    off = [abs(size - there) for (size, *_), there in zip(sizes, true, strict=True)]
    inside = sum(low <= there <= high for (_, low, high), there in zip(sizes, true, strict=True))
    half = [(high - low) / 2 for _, low, high in sizes]
    said = text_of(page)
    assert re.search(rf"\b{len(named)} (of {len(withheld)}|temperatures were named)", said)
    assert re.search(
        rf"{round(median(off), 6):.1f} K (off )?in the median(,| and) {max(off):.0f} at worst", said
    )
    assert re.search(
        rf"\b{inside} within (the interval of )?\+/- {min(half):.0f} to {max(half):.0f} K \(90 %\)", said
    )


@pytest.mark.parametrize("page", [*FIRST, MEASURED])
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


@pytest.mark.parametrize("page", [*FIRST, MEASURED])
def test_how_often_a_verdict_beside_a_known_good_record_is_right(page):
    """They were told as how often each was given, which reads as how often it is right."""
    rows = cases("aesi bench real") + cases("aesi bench real, archive")
    beside = [row for row in rows if not row["declared, mV"]]
    right = [
        sum(row["verdict"].startswith(verdict) and row["right"] == "yes" for row in beside)
        for verdict in ("found", "none")
    ]
    wrong = [row["case"] for row in beside if row["verdict"] == "none" and row["right"] == "no"]
    said = text_of(page)
    told = re.search(r"\b(\d+) (?:of \d+|of these) found(?:,|\.| and) (\d+) (?:of \d+|of these) none", said)
    assert told
    assert [int(told[1]), int(told[2])] == right
    sizes = {"current gain": [], "voltage offset": [], "voltage lag": []}
    for about in wrong:
        kind, _, size = about.rpartition(" ")
        sizes[kind].append(float(size))
    gains, offsets, lags = sizes.values()
    told = [
        f"a current gain of {100 * (min(gains) - 1):.0f} to {100 * (max(gains) - 1):.0f} %",
        f"a voltage offset of {1e3 * min(offsets):.0f} to {1e3 * max(offsets):.0f} mV",
        *(f"a lag of {size:g} s" for size in lags),
    ]
    assert f"{', '.join(told[:-1])} or {told[-1]} put in" in said


@pytest.mark.parametrize("page", FIRST)
def test_how_often_a_name_that_is_no_temperature_is_right(page):
    rows = cases("aesi bench real") + cases("aesi bench real, archive")
    named = [row for row in rows if row["declared, mV"] and ":" in row["verdict"]]
    others = [row["right"] == "yes" for row in named if "ambient_temperature" not in row["verdict"]]
    assert f"{sum(others)} of {len(others)}" in text_of(page)
    assert all(row["right"] == "yes" for row in named if "ambient_temperature" in row["verdict"])
    before = [row for row in cases("aesi bench real") if row["case"].startswith("temperature withheld")]
    found = sum(row["right"] == "yes" for row in before)
    assert f"{found} of {len(before)} records met before" in text_of(page)


def test_how_often_an_artificial_sensor_fault_is_named():
    """The first page said 5 of 18 beside a known-good record, where the table has 6."""
    rows = cases("aesi bench real")
    faults = [row for row in rows if row["case"].split()[:2] in FAULTS]
    alone, beside = (
        [row["right"] == "yes" for row in faults if bool(row["declared, mV"]) == without]
        for without in (True, False)
    )
    told = f"{sum(alone)} of {len(alone)}; with a known-good record {sum(beside)} of {len(beside)}"
    assert told in text_of("docs/index.md")


def table_below(page, head):
    """Rows, by column, of the table of a page that begins with `head`."""
    (table,) = [
        part for part in (ROOT / page).read_text(encoding="utf-8").split("\n\n") if part.startswith(head)
    ]
    names, _, *rows = [[cell.strip() for cell in line[1:-1].split("|")] for line in table.splitlines()]
    return [dict(zip(names, row, strict=True)) for row in rows]


def rows_below(page, head):
    """The same, the cells of each row by its first."""
    return {first: rest for first, *rest in (row.values() for row in table_below(page, head))}


def test_the_counts_on_measured_cells_are_those_of_their_tables():
    told = rows_below(MEASURED, "| what was asked |")
    here, archive = cases("aesi bench real"), cases("aesi bench real, archive")

    def count(rows, *kinds, beside=False, seen=False):
        ours = [
            row["right"] == "yes"
            for row in rows
            if row["case"].startswith(kinds)
            and "warming" not in row["case"]
            and bool(row["declared, mV"]) != beside
            and (not seen or (row["nats"] and float(row["nats"]) > SEEN_NATS))
        ]
        return f"{sum(ours)} of {len(ours)}"

    faults = tuple(" ".join(words) for words in FAULTS)
    withheld, contact = "temperature withheld", "contact resistance"
    assert told["a withheld temperature is named"][0].startswith(count(here, withheld))
    assert told["a withheld temperature is named"][0].endswith(count(archive, withheld))
    named = told["a fault of a sensor is named"]
    assert named[:2] == [count(here, *faults), count(here, *faults, beside=True)]
    detectable = told["a fault of a sensor that the data can tell is named"]
    assert detectable[:2] == [
        count(here, *faults, seen=True),
        count(here, *faults, beside=True, seen=True),
    ]
    resistance = told["a contact resistance is named"]
    for cell, beside in zip(resistance, (False, True), strict=False):
        assert cell.startswith(count(here, contact, beside=beside))
        assert cell.endswith(count(here, contact, beside=beside, seen=True))
    silent = told["nothing is wrong, and nothing is named"]
    assert silent[0].startswith(count(here, "control"))
    assert silent[0].endswith(count(archive, "control"))
    assert silent[1] == count(here, "control", beside=True)
    assert told["ageing is named correctly"][0] == count(here, "ageing")
    alone = [[float(row[key]) for key in STATES] for row in here if row["declared, mV"]]
    worse = sum(after > 1.05 * declared for declared, _, after in alone)
    than_better = sum(after > 1.05 * min(declared, refitted) for declared, refitted, after in alone)
    assert told["the written model is more than 5 % worse than the declared one on the last part"][0] == (
        f"{worse} of {len(alone)}"
    )
    both = told["the same, than the better of the declared and the recalibrated one"][0]
    assert both == f"{than_better} of {len(alone)}"
    assert f"In {than_better} of {len(alone)} cases" in text_of("docs/benchmarks/index.md")


def test_what_is_said_of_left_out_records_is_what_their_table_says():
    rows = cases("aesi bench left_out")
    times = {
        (row["cell"], row["left-out record"]): float(row["as written / better"].strip("*")) for row in rows
    }
    holds = [each <= AS_GOOD for each in times.values()]
    others = sorted(each for each in times.values() if each > AS_GOOD)
    better = [each for each in times.values() if each <= 0.98]
    said = text_of(LEFT_OUT)
    assert f"On {sum(holds)} of {len(holds)} records" in said
    assert f"On the {len(others)} others it is {others[0]:.2f} to {others[-1]:.2f} times as far off" in said
    assert (
        f"On {len(better)} records it is {100 * (1 - max(better)):.0f} to {100 * (1 - min(better)):.0f} % better"
        in said
    )
    by_cell = [cell for cell, _ in times]
    told = list(rows_below(LEFT_OUT, "| cell | holds on |").values())
    counted = [
        f"{sum(t <= AS_GOOD for (c, _), t in times.items() if c == cell)} of {by_cell.count(cell)}"
        for cell in (
            "about_energy_nmc",
            "lg_m50t_w8",
            "lg_18650hg2",
            "panasonic_ncr18650pf",
            "about_energy_lfp",
        )
    ]
    assert [cell for (cell,) in told] == counted


def test_what_is_said_of_splits_is_what_their_table_says():
    page = (ROOT / "docs" / "benchmarks" / "splits.md").read_text(encoding="utf-8")
    table = page.split("<!-- table of aesi bench splits -->\n")[1].split("\n\n")[0].splitlines()
    head, _, *rows = [[cell.strip() for cell in line[1:-1].split("|")] for line in table]
    rows = [dict(zip(head, row, strict=True)) for row in rows]
    home = [row for row in rows if row["validation minus test, points"]]
    abroad = [row for row in rows if not row["validation minus test, points"]]

    def pairs(of, column):
        return [[float(value) for value in row[column].split(" / ")] for row in of]

    gains = pairs(home, "AESI I against recalibrated, %")
    away = [abs(mean) for mean, _ in pairs(abroad, "AESI I against recalibrated, %")]
    said, first = text_of("docs/benchmarks/splits.md"), text_of("docs/benchmarks/index.md")
    assert f"it takes {min(gains)[0]:.1f} to {max(gains)[0]:.1f} % of the squared error off" in said
    assert f"On the worst split it adds {-min(worst for _, worst in gains):.1f} %" in said
    assert f"({min(away):.1f} to {max(away):.1f} %)" in said
    assert f"{min(away):.1f} to {max(away):.1f} % of what recalibration leaves" in first
    for row, ours, alone in zip(home, pairs(home, "AESI I, %"), pairs(home, "recalibrated, %"), strict=True):
        name = row["cell"].split(",")[0].split()[-1].replace("pouch", "pouch cell").replace("18650", "LFP")
        assert re.search(rf"{name} {ours[0]:.1f} (% )?\({alone[0]:.1f}\b", first), row["cell"]
    covered = pairs(home, "coverage of AESI I, %")
    assert f"{min(covered)[0]:.1f} to {max(covered)[0]:.1f} % of all rows" in first
    assert f"{min(worst for _, worst in covered):.1f} % of the worst drive" in first


def test_the_right_answers_of_some_seeds_counted_look_alikes_beside_seeds_that_did_not():
    page = "docs/benchmarks/virtual-cells.md"
    rows = [
        *table_below(page, "| cases | exactly right |"),
        *(row for row in table_below(page, "| seed | cases |") if row["exactly right"]),
    ]
    assert len(rows) == 4 + 9
    columns = ("with effects, exact", "nothing missing, named", "strangers `unknown`")
    for row in rows:
        (exact, effects), (named, nothing), (silent, strangers) = (
            map(int, re.match(r"(\d+) of (\d+)", row[column]).groups()) for column in columns
        )
        cases_met = int(re.findall(r"\d+", row["cases"])[-1])
        assert effects + nothing + strangers == cases_met, row
        assert exact + (nothing - named) + silent == int(re.match(r"\d+", row["exactly right"])[0]), row


ASKED = {
    "a withheld temperature is named": "withheld_named_pct",
    "and within 2 K of the thermocouple's mean": "withheld_within_2k_pct",
    "a fault of a sensor is named": "fault_named_pct",
    "a fault of a sensor that the data can tell is named": "fault_seen_named_pct",
    "nothing is wrong, and nothing is named": "control_silent_pct",
    "a resistance is within 15 % of the impedance spectrum's": "witness_within_15pct_pct",
    "the same, than the better of the declared and the recalibrated one": "after_worse_pct",
}
"""Row of the first table on measured cells -> key of the figure in the report."""


def test_what_is_asked_for_on_measured_cells_stood_in_the_report_alone():
    told = rows_below(MEASURED, "| what was asked |")
    words = {"0": "none", "100": "all"}
    aims = {name: FIGURES[key][1] for name, key in ASKED.items()}
    assert {name: row[-1] for name, row in told.items() if row[-1]} == {
        name: words.get(aim, aim.replace(" or more", " % or more")) for name, aim in aims.items()
    }


@pytest.mark.parametrize("page", [*FIRST[1:], LEFT_OUT])
def test_how_often_several_unaltered_records_of_a_cell_get_a_name(page):
    verdicts = [row["verdict"] for row in cases("aesi bench left_out")]
    named = sum(":" in verdict for verdict in verdicts)
    said = text_of(page)
    assert f"together {named} of {len(verdicts)}" in said or f"In {named} of them an effect is named" in said


def test_temperatures_of_a_table_were_off_by_as_much_as_another_figure():
    """It was how far the written model's mean course is off, beside the sizes that were found."""
    rows = [
        row for row in cases("aesi bench real") if row["case"] == "temperature withheld" and row["estimate"]
    ]
    off = [abs(float(row["estimate"].split()[0]) - float(row["true size"])) for row in rows]
    assert f"and {min(off):.1f} to {max(off):.1f} K off" in text_of(MEASURED)


def test_the_newest_recorded_run_on_measured_cells_is_that_of_the_table():
    """Rates of a run by earlier files stood below the table."""
    runs = [line for entry in read_history(ROOT / "docs" / "benchmarks.json") for line in entry.lines]
    last = [line for line in runs if line["bench"] == "real"][-1]
    rows = [row for row in cases("aesi bench real") if row["estimate"].endswith("mohm")]
    pairs = [
        (float(true), float(found))
        for row in rows
        for true, found in zip(
            *(re.findall(r"[\d.]+", row[key]) for key in ("true size", "estimate")), strict=True
        )
    ]
    near = sum(abs(found / true - 1.0) <= NEAR_SHARE for true, found in pairs)
    assert last["witness_within_15pct_pct"] == pytest.approx(100.0 * near / len(pairs))
    said = text_of(MEASURED)
    assert (
        f"took {last['processor_s_total']:,.0f} s of processor time ({last['processor_s_median']:.0f} s"
        in said
    )


@pytest.mark.parametrize(("title", "cell"), [("HG2", "lg_18650hg2"), ("Panasonic", "panasonic_ncr18650pf")])
def test_what_the_written_models_leave_in_sum_is_that_of_their_table(title, cell):
    rows = [row for row in cases("aesi bench left_out") if row["cell"] == cell]
    names = ("as written, mV", "declared, mV", "recalibrated, mV")
    after, declared, refitted = (sum(float(row[name]) for row in rows) for name in names)
    told = f"is {after:.0f} mV as written, {declared:.0f} as declared and {refitted:.0f} recalibrated"
    assert told in text_of(LEFT_OUT)


@pytest.mark.parametrize("page", [*FIRST, "docs/benchmarks/index.md", "docs/cells.md"])
def test_how_far_off_the_files_are_on_held_out_records_at_25_degc(page):
    """The HG2's median was that of its chamber, with a drive at 39 degC and a discharge at 5 in it."""
    page_of_cells = (ROOT / "docs" / "cells.md").read_text(encoding="utf-8")
    table = page_of_cells.split("aesi bench cells, archive -->")[1].split("<!-- end of archive -->")[0]
    head, _, *rows = (
        line.strip("| ").split(" | ") for line in re.findall(r"^    (\|.*)", table, re.MULTILINE)
    )
    column = head.index("with temperature")
    a, b = (
        f"{median(float(row[column].split()[0]) for row in rows if row[0] == ours and row[1].startswith(WARM)):.0f}"
        for ours in ("panasonic_ncr18650pf", "lg_18650hg2")
    )
    said = text_of(page)
    assert any(words in said for words in (f"{a} and {b} mV", f"{b} and {a} mV", f"| 25 °C | {a} | {b} |"))


def test_how_far_off_the_panasonics_file_is_on_its_charges():
    text = (ROOT / "docs" / "cells.md").read_text(encoding="utf-8")
    table = text.split("aesi bench cells, charges -->")[1].split("<!-- end of charges -->")[0]
    head, _, *rows = (
        line.strip("| ").split(" | ") for line in re.findall(r"^    (\|.*)", table, re.MULTILINE)
    )
    as_is, aged = (
        f"{geometric_mean(float(row[head.index(name)].split()[0]) for row in rows):.0f}"
        for name in ("with temperature", "aged")
    )
    told = f"{as_is} mV (geometric mean of {len(rows)} charges of the Panasonic), and {aged} with"
    assert told in text_of("docs/cells.md")
    assert f"at 1C are {as_is} mV off ({aged} with" in text_of("docs/limits.md")
