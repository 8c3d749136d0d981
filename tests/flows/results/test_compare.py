"""Runs side by side on one page."""

import json
import re
import shutil
from dataclasses import replace

import pytest

from aesi.errors import InputError
from aesi.pipeline.report.compare import ComparedRun, differing_settings, write_comparison
from flows.jobs.experiment import _uri_option
from flows.results.compare import PROGRAM, _judged_on, compare
from flows.results.tables import tables_of
from flows.tracking.experiment_log import CODE
from flows.tracking.store import EXPERIMENT, JOB, KIND, SHORTEST_ID, Store
from flows.tracking.tracker import _texts
from flows.tracking.whole_run import NestedRun, insert_run


def run_of(number, **settings):
    grid = [[round(0.1 * number * (i - j), 3) for j in range(16)] for i in range(16)]
    one_map = {"current_a": list(range(16)), "soc": [i / 16 for i in range(16)], "mean_mv": grid}
    return ComparedRun(
        run_id=f"{number:032x}",
        name=f"cell {number}",
        experiment="study",
        started="2026-01-01 00:00",
        settings={"seed": str(number), "data.dt_s": "1.0", **settings},
        metrics={
            "free_run/test_rmse_mv": 2.0 + number,
            "free_run/test_mser_pct": 50.0,
            "one_step/test_rmse_mv": 0.5,
            "intervals/coverage_pct": 90.5,
        },
        chosen="ESPM + AESI I",
        comparison={
            "genome": {"lambda1": 0.1 * (number + 1), "d": 2},
            "terms": {"T1(I)": 0.5, f"T{number}(soc)": 0.1},
            "intervals": {"ESPM + AESI I": {"test_rmse_mv": [1.5 + number, 2.5 + number]}},
            "maps": {"ESPM": one_map, "ESPM + AESI I": one_map},
        },
    )


def test_a_mapping_that_one_run_leaves_empty_is_shown_by_its_entries_alone(tmp_path):
    """`data.from_s` and `data.from_s.drive` were both shown, and both named by `aesi tables`."""
    runs = [
        run_of(1, **{"data.from_s": "{}", "data.repeats": "null", "data.columns": "{}"}),
        run_of(
            2,
            **{
                "data.from_s.drive": "600.0",
                "data.repeats.period_s": "1800.0",
                "data.columns": '{"a:b": "c"}',
            },
        ),
    ]
    differing = ["seed", "data.columns", "data.from_s.drive", "data.repeats.period_s"]
    assert differing_settings(runs) == differing
    page = write_comparison(tmp_path / "page.html", runs).read_text()
    assert "Only the settings that differ; 1 are the same in all." in page  # data.dt_s


def test_only_settings_that_differ_are_shown(tmp_path):
    runs = [run_of(1), run_of(2, extra="yes")]
    assert differing_settings(runs) == ["seed", "extra"]
    html = write_comparison(tmp_path / "page.html", runs).read_text()
    assert '<th scope="col">extra</th>' in html
    assert "data.dt_s</th>" not in html
    assert html.count("2.5 to 3.5") == 1  # the range of the free run, not of the figure one step ahead
    assert "T1(soc)" in html
    assert "T1(I)" not in html  # all runs hold it


def test_many_settings_that_differ_ran_out_of_the_page(tmp_path):
    many = {f"data.key_{k}": "given" for k in range(9)}
    html = write_comparison(tmp_path / "page.html", [run_of(1), run_of(2, **many)]).read_text()
    assert '<th scope="col">data.key_8</th>' not in html
    assert "data.key_8</t" in html


def heading_of(tmp_path, *runs):
    html = write_comparison(tmp_path / "page.html", runs).read_text()
    assert html.index("What came of it") < html.index("What was different")
    return re.search("<h1>(.*?)</h1>", html)[1].replace("\u00a0", " ")


def test_the_first_sentence_of_a_page_counted_settings_and_not_what_came_of_them(tmp_path):
    best, second, third = (run_of(number) for number in (1, 2, 3))
    text = heading_of(tmp_path, second, best, third)
    assert (
        text == f"{best.label} errs least in free run on test records: 3 mV RMSE, the other 2 by 4 to 5 mV."
    )
    assert heading_of(tmp_path, best, second).endswith("3 mV RMSE, the other by 4 mV.")
    assert heading_of(tmp_path, best, best) == "The 2 runs err by 3 mV RMSE in free run on test records."
    told_apart = heading_of(tmp_path, best, best, third)
    assert told_apart == "The 3 runs err by 3 to 5 mV RMSE in free run on test records."
    harmed = replace(second, metrics=second.metrics | {"free_run/test_mser_pct": -20.0})
    assert heading_of(tmp_path, best, harmed).endswith(" 1 of 2 errs by more than the declared model alone.")
    assert "All err by more than the declared" in heading_of(tmp_path, harmed, harmed)
    found = [
        replace(best, metrics={}, discovery={"verdict": word, "effects": [], "candidates": []})
        for word in ("found", "unknown", "found")
    ]
    assert (
        "<h1>Of 3 discoveries: 2 found, 1 unknown.</h1>"
        in write_comparison(tmp_path / "d.html", found).read_text()
    )


def test_one_run_beside_a_stopped_one_was_called_all(tmp_path):
    harmed = replace(run_of(1), metrics=run_of(1).metrics | {"free_run/test_mser_pct": -20.0})
    stopped = replace(run_of(2), metrics={}, chosen="", comparison={}, finished=False)
    assert heading_of(tmp_path, stopped, harmed) == (
        f"{harmed.label} errs by more than the declared model alone. {stopped.label} has not finished."
    )


def test_runs_that_were_judged_on_different_records_had_a_winner(tmp_path):
    one = replace(run_of(1), judged_on="abc")
    other = replace(run_of(2), judged_on="def", metrics=run_of(2).metrics | {"free_run/test_mser_pct": -20.0})
    text = heading_of(tmp_path, one, other)
    assert text == (
        "The 2 runs were not judged on the same test records at the same step, so that their errors do not compare. "
        "1 of 2 errs by more than the declared model alone on its own test records."
    )
    assert "On the test records of each run, which differ" in (tmp_path / "page.html").read_text()
    assert "errs least" in heading_of(tmp_path, one, replace(other, judged_on="abc"))


def test_what_a_run_was_judged_on_is_its_test_records_whatever_it_was_trained_on():
    given = {"data_digest": "a, b, c", "data.train": '["1", "2"]', "data.test": '["3"]'}
    more = {"data_digest": "d, c", "data.train": '["4"]', "data.test": '["renamed"]'}
    other = {**given, "data_digest": "a, b, edited"}
    assert _judged_on(given) == _judged_on(more) != _judged_on(other)
    # Averages over six seconds err less than those over two, whatever the model is worth.
    assert _judged_on(given | {"data.dt_s": "2.0"}) != _judged_on(given | {"data.dt_s": "6.0"})
    cut = {"data_digest": "a", "data.test": "[]", "data.repeats.test": "[3]"}
    assert _judged_on(cut) != _judged_on(cut | {"data.repeats.test": "[4]"})


def test_runs_with_more_test_records_than_a_parameter_can_name_are_compared():
    names = [
        f"../measured/campaign_2026/cell_07/drives/udds_{i:03d}_25degC_2026-03-11.csv" for i in range(400)
    ]
    digests = [f"{i:016x}" for i in range(403)]

    def tracked_of(names, digests):
        return _judged_on(_texts({"data.test": names, "data_digest": ", ".join(digests)}))

    assert tracked_of(names, digests) == tracked_of(names, digests)
    assert tracked_of(names, digests) != tracked_of(names, [*digests[:-1], "another"])
    assert tracked_of(names, digests) != tracked_of([*names[:-1], "another.csv"], digests)


def test_the_model_that_a_search_ended_with_is_no_setting(tracked):
    store, tags = Store(), {KIND: "run"}
    for chosen in ("ESPM + AESI I", "ESPM + AESI II"):
        run_id = store.create_run(store.experiment("two"), "two", tags)
        store.client.log_param(run_id, "chosen_model", chosen)
        store.client.set_terminated(run_id)
    shown = compare(["two"], tracked / "page.html")
    assert differing_settings(shown) == []
    assert [run.chosen for run in shown] == ["ESPM + AESI I", "ESPM + AESI II"]


@pytest.mark.parametrize("earlier", [False, True], ids=["now", "by an earlier version"])
def test_runs_and_discoveries_of_one_name_stood_in_one_table(call, tracked, earlier):
    store = Store()
    asked = [
        ("experiment", {"seed": 0, "data.dt_s": 1.0}, {"free_run/test_rmse_mv": 2.0}, {}),
        ("discovery", {"seed": 3, "holdout": 0.3}, {"after/test_rmse_mv": 7.0}, {"verdict": "none"}),
        ("experiment", {"seed": 1, "data.dt_s": 1.0}, {"free_run/test_rmse_mv": 4.0}, {}),
        ("benchmark", {"seed": 0, "cases": 25}, {"right": 20.0}, {}),
    ]
    for job, settings, metrics, tags in asked:
        noted = {KIND: "run", **tags, **({} if earlier else {JOB: job})}
        run_id = store.create_run(store.experiment("both"), job, noted)
        for name, value in settings.items():
            store.client.log_param(run_id, name, value)
        for name, value in metrics.items():
            store.client.log_metric(run_id, name, value)
        if "verdict" in tags:
            found = {"verdict": tags["verdict"], "effects": [], "candidates": []}
            store.client.log_dict(run_id, found, "discovery.json")
        store.client.set_terminated(run_id)
    code, _, err = call("compare", "both", "--out", tracked / "page.html")
    assert (code, err.strip().endswith("page.html: 2 runs, 1 discovery, 1 benchmark")) == (0, True)
    assert call("compare", "both", "--out", tracked / "page.html")[0] == 0  # its own page is replaced
    html = (tracked / "page.html").read_text()
    tables = dict(re.findall(r'<section id="([^"]+)">(.*?)</section>', html, re.DOTALL))
    assert list(tables) == [
        "experiment-metrics",
        "experiment-settings",
        "discovery-metrics",
        "discovery-verdicts",
        "benchmark-metrics",
    ]
    assert '<th scope="col">right</th>' in tables["benchmark-metrics"]
    assert "test records" not in tables["benchmark-metrics"]
    assert "<h2>What was different: runs</h2>" in tables["experiment-settings"]
    assert "Only the settings that differ; 1 are the same in all." in tables["experiment-settings"]
    for key, own, other in (
        ("experiment", "RMSE, free run, mV", "as written"),
        ("discovery", "as written", "RMSE"),
    ):
        assert own in tables[f"{key}-metrics"]
        assert other not in tables[f"{key}-metrics"]


def test_the_page_needs_nothing_from_elsewhere(tmp_path):
    html = write_comparison(tmp_path / "page.html", [run_of(1), run_of(2)]).read_text()
    assert not re.search(r'(src|href)="(?!data:)', html)
    payload = json.loads(re.search(r'id="maps-data">(.*?)</script>', html, re.DOTALL)[1])
    assert len(payload["maps"]) == 4


def test_a_discovery_shows_its_verdict_and_parameters(tmp_path):
    parameters = {"resistance_ohm": {"value": 1.5e-3, "low": 1.4e-3, "high": 1.6e-3, "unit": "ohm"}}
    found = {
        "verdict": "found",
        "effects": ["series_resistance"],
        "candidates": [{"effect": "series_resistance", "parameters": parameters}],
    }
    runs = [
        run_of(1),
        ComparedRun(
            "ab" * 16, "trace", "discover", "now", {}, {"confidence": 0.97}, discovery=found, job="discovery"
        ),
    ]
    html = write_comparison(tmp_path / "page.html", runs).read_text()
    assert "series_resistance.resistance_ohm" in html
    assert "0.0014 to 0.0016" in html


def test_the_page_explains_what_is_on_it(tmp_path):
    found = {"verdict": "unknown", "effects": [], "candidates": []}
    metrics = {"before/test_rmse_mv": 25.6, "after/test_rmse_mv": 6.2}
    runs = [
        ComparedRun(f"{k:032x}", "trace", "discover", "now", {}, metrics, discovery=found) for k in (1, 2)
    ]
    html = write_comparison(tmp_path / "page.html", runs).read_text()
    assert "as written, test, mV" in html  # which an unknown has no finding for
    for word in ("MSER", "Ranges below", '<th scope="col">model</th>'):
        assert word not in html
        assert word in write_comparison(tmp_path / "runs.html", [run_of(1), run_of(2)]).read_text()


def test_an_experiment_without_a_finished_run_was_offered_to_be_compared(tmp_path):
    uri = f"sqlite:///{tmp_path / 'mlflow.db'}"
    store = Store(uri)
    for name, status in (("ended", "FINISHED"), ("stopped", "FAILED")):
        run = store.client.create_run(store.client.create_experiment(name), tags={KIND: "run"})
        store.client.set_terminated(run.info.run_id, status)
    with pytest.raises(InputError, match=r"'stopped' is no tracked run .*; experiments with one: ended\.$"):
        compare(["stopped"], tmp_path / "page.html", uri)


def test_tracked_runs_are_found_by_the_beginning_of_their_id(finished, tmp_path):
    uri = f"sqlite:///{finished / 'mlflow.db'}"
    store = Store(uri)
    (run,) = store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = 'run'")
    with pytest.raises(InputError, match="there is 1 run to compare"):
        compare([run.info.run_id[:8], "smoke"], tmp_path / "page.html", uri)
    folder = f"runs/smoke/{run.info.run_id}/"  # stands for the run that wrote it
    with pytest.raises(InputError, match="there is 1 run to compare"):
        compare([folder], tmp_path / "page.html", uri)
    assert store.run(folder).info.run_id == run.info.run_id
    with pytest.raises(InputError, match="'nowhere' is no tracked run and no experiment"):
        compare(["nowhere"], tmp_path / "page.html", uri)
    content = json.loads(store.artifact(run, "comparison.json").read_text())
    assert set(content["maps"]) == {"ESPM", run.data.params["chosen_model"]}
    low, high = content["intervals"][run.data.params["chosen_model"]]["test_rmse_mv"]
    assert low < run.data.metrics["free_run/test_rmse_mv"] < high
    assert content["intervals"]["ESPM"]["test_mser_pct"] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_runs_of_two_versions_of_the_program_differed_by_their_seed_alone(finished, tmp_path):
    """`aesi tables` leaves out what another version ran; the page said that all other settings are the same."""
    database = tmp_path / "mlflow.db"
    for path in finished.glob("mlflow.db*"):
        shutil.copy(path, tmp_path / path.name)
    store = Store(f"sqlite:///{database}")
    (run,) = store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = 'run'")
    again = store.client.create_run(run.info.experiment_id, tags=run.data.tags | {CODE: "0123456789abcdef"})
    for key, value in run.data.params.items():
        store.client.log_param(again.info.run_id, key, value)
    store.client.set_terminated(again.info.run_id)
    runs = compare(["smoke"], tmp_path / "page.html", f"sqlite:///{database}")
    assert differing_settings(runs) == [PROGRAM]
    assert {each.settings[PROGRAM] for each in runs} == {run.data.tags[CODE][:8], "01234567"}


def test_runs_of_files_that_were_edited_under_their_names_had_no_setting_that_differs(finished):
    store = Store(f"sqlite:///{finished / 'mlflow.db'}")
    (run,) = store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = 'run'")
    digests = run.data.params["data_digest"].split(", ")
    assert len(digests) == len(set(digests)) == 5
    assert len(run.data.params["cell_digest"]) == 16


def test_five_hundred_runs_make_one_page_of_a_size_that_opens(tracked, tmp_path):
    """From the tracking store to the page, with 60 settings and 60 figures a run."""
    store = Store()
    experiment = store.experiment("study")
    for number in range(500):
        run = run_of(number, **{f"search.p{k}": "0.1" for k in range(60)})
        whole = NestedRun(
            experiment_id=experiment,
            parent="",
            label="",
            name=run.name,
            tags={},
            params=run.settings,
            metrics=dict(run.metrics) | {f"tables/m{k}": 0.5 for k in range(60)},
            files={},
            status="FINISHED",
            start_ms=number,
            end_ms=number + 1,
        )
        folder = tracked / "mlartifacts" / "study" / run.run_id / "artifacts"
        folder.mkdir(parents=True)
        (folder / "comparison.json").write_text(json.dumps(run.comparison))
        insert_run(store.database, whole, folder.as_uri(), {KIND: "run"})
    found = compare(["study"], tmp_path / "page.html")
    assert len(found) == 500
    assert (tmp_path / "page.html").stat().st_size < 20e6


@pytest.mark.parametrize("command", ["compare", "candidate"])
def test_what_waits_in_the_workspace_was_not_compared_nor_rebuilt(tracked, call, command):
    store = Store()
    experiment = store.experiment("two")
    first, second = (store.create_run(experiment, "two", {KIND: "run"}) for _ in range(2))
    waiting = {"kind": "end", "run_id": first, "status": "FINISHED", "at_ms": 2_000}
    outbox = tracked / ".aesi" / "outbox" / first
    outbox.mkdir(parents=True)
    (outbox / "00000001.json").write_text(json.dumps(waiting))
    more = [second] if command == "compare" else ["--out", "made"]
    _, _, err = call(command, first, *more)
    assert f"what run {first[:8]} had left over is delivered" in err
    assert store.client.get_run(first).info.status == "FINISHED"


def test_the_hints_at_the_end_of_a_run_did_not_find_it_on_a_server():
    assert _uri_option(None) == ""
    assert _uri_option("https://me:secret@host/my runs") == " --uri 'https://USER:PASSWORD@host/my runs'"


def test_the_time_of_a_fit_is_called_so_of_an_earlier_version_s_runs_too(tracked, tmp_path):
    store = Store()
    experiment = store.experiment("two")
    for job in ("experiment", "experiment", "discovery", "discovery"):
        run_id = store.create_run(experiment, "two", {KIND: "run", JOB: job})
        store.client.log_metric(run_id, "seconds", 0.5)
        store.client.set_terminated(run_id)
    runs = compare(["two"], tmp_path / "page.html")
    assert [list(run.metrics) for run in runs if run.job == "experiment"] == [["fit_and_evaluation_s"]] * 2
    html = (tmp_path / "page.html").read_text()
    assert [html.count(f">{words}</th>") for words in ("fit and evaluation, s", "time, s")] == [1, 1]


def test_an_artifact_that_the_server_lists_and_does_not_give_was_taken_for_none(finished, monkeypatch):
    store = Store(f"sqlite:///{finished / 'mlflow.db'}")
    (run,) = store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = 'run'")
    assert store.artifact(run, "no such.json") is None
    monkeypatch.setattr(run.info, "_artifact_uri", "mlflow-artifacts:/of/a/server")

    def refused(run_id, name):
        raise OSError("403 Forbidden")

    monkeypatch.setattr(store.client, "download_artifacts", refused)
    with pytest.raises(InputError, match=r"carries no readable comparison\.json \(403 Forbidden\)"):
        store.artifact(run, "comparison.json")


def test_a_run_whose_files_lie_on_another_machine_was_compared_as_one_that_has_none(
    call, tracked, tmp_path_factory
):
    store, there = Store(), tmp_path_factory.mktemp("there") / "mlartifacts" / "drive"
    number = store.client.create_experiment("drive", there.as_uri())
    found = {"verdict": "found", "effects": ["series_resistance"], "candidates": []}
    for _ in range(2):
        run_id = store.create_run(number, "drive", {KIND: "run", JOB: "discovery", "verdict": "found"})
        store.client.log_dict(run_id, found, "discovery.json")
        store.client.set_terminated(run_id)
    code, _, err = call("compare", "drive", "--out", tracked / "page.html")
    assert (code, "missing" in err) == (0, False)
    assert "Of 2 discoveries: 2 found." in (tracked / "page.html").read_text().replace("\u00a0", " ")

    there.rename(there.with_name("gone"))
    code, _, err = call("compare", "drive", "--out", tracked / "page.html")
    said = f"verdicts of drive are missing: its files are in {there}, which is not here; mount or restore it"
    assert (code, err.count(said)) == (0, 1)
    assert said in re.sub(r"&nbsp;|\u00a0", " ", (tracked / "page.html").read_text())


def test_the_beginning_of_an_id_was_refused_without_a_word_on_its_length(tmp_path):
    uri = f"sqlite:///{tmp_path / 'mlflow.db'}"
    store = Store(uri)
    tags = {KIND: "run", JOB: EXPERIMENT}
    run_id = store.client.create_run(store.client.create_experiment("mine"), tags=tags).info.run_id
    store.client.set_terminated(run_id, "FINISHED")
    short = run_id[: SHORTEST_ID - 1]
    for asked in (
        lambda: compare([short], tmp_path / "page.html", uri),
        lambda: tables_of("mine", run_ids=[short], uri=uri),
        lambda: store.run(short),
    ):
        with pytest.raises(InputError, match=rf"'?{short}'? .*{SHORTEST_ID} letters"):
            asked()
    assert store.run(run_id[:SHORTEST_ID]).info.run_id == run_id
    with pytest.raises(InputError, match=rf"There are: {run_id[:8]}\.$"):
        tables_of("mine", run_ids=["anotherone"], uri=uri)
