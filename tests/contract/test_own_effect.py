"""An effect of the user's own, from its file, goes wherever an effect of the catalogue goes."""

import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lead_effect import OWN

import aesi
from aesi.constants import ZERO_CELSIUS_K
from aesi.errors import ConfigError, InputError, NoNumberError, OwnEffectError, ParameterError
from aesi.parameters import Parameter
from aesi.physics import Contribution, Effect
from aesi.physics.effects import CATALOGUE, activated, known_effects, load_effect
from aesi.physics.folded import folded
from aesi.pipeline.discovery.discover import Case, write_discovery
from aesi.pipeline.experiment.config import parse_experiment
from aesi.pipeline.experiment.load import load
from aesi.pipeline.simulation import ProfileRequest, predict_file, simulate_file
from aesi.records import Measurement
from aesi.tracer import discover

CELL = Path(__file__).resolve().parents[2] / "experiments" / "cells" / "nmc_30ah.bpx.json"
LEAD_OHM = 1e-3
SOC0 = 0.8
TIME = np.arange(1800.0)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("own") / "lead.py"
    path.write_text(OWN)
    return path


@pytest.fixture(scope="module")
def cell():
    return aesi.Cell.from_bpx(CELL)


@pytest.fixture(scope="module")
def current():
    rng = np.random.default_rng(0)
    held = np.repeat(rng.normal(10.0, 30.0, len(TIME) // 20), 20)
    held[:60] = 0.0
    return held


@pytest.fixture(scope="module")
def bare(cell, current):
    return aesi.simulate(cell, TIME, current, SOC0).voltage_v


@pytest.fixture(scope="module")
def measured(bare, current, tmp_path_factory):
    """The record of a cell with the lead, as a file and as a measurement."""
    noise = 1e-3 * np.random.default_rng(1).normal(size=len(TIME))
    record = Measurement(TIME, current, bare - LEAD_OHM * current + noise, name="drive")
    path = tmp_path_factory.mktemp("record") / "drive.csv"
    table = np.column_stack([record.time_s, record.current_a, record.voltage_v])
    np.savetxt(path, table, delimiter=",", header="time_s,current_a,voltage_v", comments="")
    return path, record


def test_it_is_simulated_from_a_file_on_the_command_line(file, measured, bare, current, tmp_path):
    run = simulate_file(
        CELL,
        measured[0],
        tmp_path / "out.csv",
        ProfileRequest(soc0=SOC0),
        effects=activated([("lead", {"lead_ohm": LEAD_OHM})], [file]),
    )
    assert run.voltage_v == pytest.approx(bare - LEAD_OHM * current, abs=1e-9)
    assert "lead_v" in (tmp_path / "out.csv").read_text().splitlines()[0]


def test_a_finding_was_lost_where_it_cannot_be_simulated_on_the_test_part(cell, current, tmp_path):
    limit_a = 120.0

    def drop(trace, *, resistance_ohm):
        return Contribution(-resistance_ohm * np.where(trace.current_a < limit_a, trace.current_a, np.nan))

    pulsed = np.where(np.abs(TIME - 1704.0) < 5.0, 1.2 * limit_a, current)
    noise = 1e-3 * np.random.default_rng(1).normal(size=len(TIME))
    voltage = aesi.simulate(cell, TIME, pulsed, SOC0).voltage_v - LEAD_OHM * pulsed + noise
    record = Measurement(TIME, pulsed, voltage, name="pulsed")

    p = Parameter(1e-3, "ohm", bounds=(0.0, 0.05), neutral=0.0, source="test")
    short = Effect("short", "physics", "A drop.", {"resistance_ohm": p}, on_voltage=drop)
    found = discover(cell, [record], soc0=SOC0, effects={"short": short})
    assert (found.verdict.word, found.verdict.effects) == ("found", ("short",))
    (warning,) = (w for w in found.warnings if "the written model has no figure on the test part" in w)
    assert "no number at 1700 s" in warning
    content = write_discovery(tmp_path, Case(CELL, (record,)), found)
    assert content["after"]["test"] == {}
    assert content["after"]["fit"]["rmse_mv"] < content["before"]["fit"]["rmse_mv"]
    assert content["candidates"][0]["test_rmse_mv"] is None
    assert [row["after_mv"] is None for row in content["files"]] == [False, True]
    assert "the written model has no figure on the test part" in (tmp_path / "report.html").read_text()


def test_it_is_found_reported_saved_simulated_and_predicted(file, cell, measured, bare, current, tmp_path):
    own = known_effects([file])
    effects = {name: own[name] for name in ("lead", "voltage_sensor_offset")}
    found = discover(cell, [measured[1]], soc0=SOC0, effects=effects)
    assert found.verdict.effects == ("lead",)
    content = write_discovery(tmp_path, Case(CELL, (measured[1],), effect_files=(file,)), found)
    assert list(content["written_parameters"]) == content["written"] == content["effects"]
    for effect, values in content["written_parameters"].items():
        named = next(c["parameters"] for c in content["candidates"] if c["effect"] == effect)
        assert values == {name: pytest.approx(p["value"]) for name, p in named.items()}
    assert content["effects"] == ["lead"]
    assert "V_cell - I R" in (tmp_path / "report.html").read_text()
    simulate_file(tmp_path / "model", measured[0], tmp_path / "simulated.csv", ProfileRequest(soc0=SOC0))
    predict_file(tmp_path / "model", measured[0], tmp_path / "predicted.csv", ProfileRequest(soc0=SOC0))
    for name in ("simulated.csv", "predicted.csv"):
        table = np.genfromtxt(tmp_path / name, delimiter=",", names=True)
        assert table["voltage_v"] == pytest.approx(bare - LEAD_OHM * current, abs=2e-3)


def test_an_experiment_takes_it(file, measured, current):
    content = {
        "name": "own",
        "data": {
            "kind": "files",
            "record": str(measured[0]),
            "hold": "linear",
            "repeats": {"period_s": 600, "train": [1, 2], "test": [3]},
        },
        "cell": {"bpx": str(CELL), "soc0": SOC0, "effects": {"lead": {"lead_ohm": LEAD_OHM}}},
    }
    with pytest.raises(ConfigError, match="no effect 'lead'"):
        load(parse_experiment(content))
    content["cell"]["effect_files"] = [str(file)]
    loaded = load(parse_experiment(content))
    left = np.concatenate([series.error_v for series in loaded.split.train])
    assert np.std(left) == pytest.approx(1e-3, rel=0.1), "what is left is the noise"


def test_it_reaches_another_process(file, tmp_path):
    (active,) = activated([("lead", {"lead_ohm": 2e-3})], [file])
    kept = tmp_path / "active.pickle"
    kept.write_bytes(pickle.dumps(active))
    code = (
        "import pickle, sys; a = pickle.load(open(sys.argv[1], 'rb')); print(a.id, a.parameters['lead_ohm'])"
    )
    done = subprocess.run([sys.executable, "-c", code, str(kept)], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["lead", "0.002"]


def test_one_of_the_catalogue_arrives_as_itself_and_one_of_a_session_by_value():
    assert pickle.loads(pickle.dumps(CATALOGUE["series_resistance"])) is CATALOGUE["series_resistance"]
    made = Effect("mine", "physics", "Mine.", on_voltage=np.copy)
    assert pickle.loads(pickle.dumps(made)).id == "mine"


def test_two_files_with_one_id_are_refused(file, tmp_path):
    other = tmp_path / "other.py"
    other.write_text(OWN)
    assert set(known_effects([file, file])) == {*CATALOGUE, "lead"}
    with pytest.raises(InputError, match="both define the effect 'lead'"):
        known_effects([file, other])


def test_a_saved_model_followed_the_edits_of_its_effect_and_could_not_be_moved(cell, tmp_path):
    own = tmp_path / "mine.py"
    own.write_text(OWN)
    aesi.HybridModel(cell, (load_effect(own).activate(lead_ohm=LEAD_OHM),), soc0=SOC0).save(
        tmp_path / "model"
    )
    own.write_text(OWN.replace("-lead_ohm", "-2 * lead_ohm"))
    (tmp_path / "model").rename(tmp_path / "moved")
    time_s, current_a = np.arange(60.0), np.full(60, 30.0)
    plain = aesi.simulate(cell, time_s, current_a, SOC0).voltage_v
    for copied in ("moved", "again"):
        model = aesi.HybridModel.load(tmp_path / copied)
        assert model.predict(time_s, current_a).voltage_v == pytest.approx(
            plain - LEAD_OHM * current_a, abs=1e-9
        )
        model.save(tmp_path / "again")
        own.unlink(missing_ok=True)


def test_an_effect_that_was_edited_in_a_saved_model_is_refused(file, cell, tmp_path):
    folder = aesi.HybridModel(cell, (load_effect(file).activate(),), soc0=SOC0).save(tmp_path / "model")
    (folder / "lead.py").write_text(OWN.replace("-lead_ohm", "-2 * lead_ohm"))
    with pytest.raises(InputError, match=r"lead\.py was edited since the model was saved with it"):
        aesi.HybridModel.load(folder)


@pytest.mark.parametrize(
    ("was", "now", "sentence"),
    [
        (OWN[: OWN.index("from")], "", "EFFECT has no docstring; write one"),
        (
            '"physics", __doc__',
            '"chemistry", __doc__',
            "the kind 'chemistry' is not known; give one of 'physics',",
        ),
        ('"lead", "physics"', '"the lead", "physics"', "the id 'the lead' has to be letters"),
        (", on_voltage=drop", "", "EFFECT acts nowhere; give it one of on_model"),
        (
            "*, lead_ohm",
            "*, lead",
            r"on_voltage cannot be called .* \(parameters: lead_ohm\): missing .* 'lead'\.",
        ),
        ("(0.0, 0.01)", "(0.01, 0.0)", "give low < high\\.$"),
        (
            OWN[OWN.index("Parameter(1e-3") : OWN.index("}")],
            "1e-3",
            "parameters of EFFECT have to be a dict of",
        ),
        ('{"lead_ohm"', '{("lead_ohm",)', "parameters of EFFECT have to be a dict of names and"),
    ],
)
def test_a_file_that_cannot_be_used_is_told_when_it_is_read(tmp_path, was, now, sentence):
    path = tmp_path / "mine.py"
    assert was in OWN
    path.write_text(OWN.replace(was, now))
    with pytest.raises(InputError, match=sentence) as caught:
        load_effect(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("body", "error", "sentence"),
    [
        (
            "-lead_ohm * trace.current_a",
            OwnEffectError,
            "on_voltage gives an object of type ndarray, not a Contribution",
        ),
        (
            "Contribution(trace.current_a[1:])",
            OwnEffectError,
            r"gives the shape \(1799,\), where the record has \(1800,\)",
        ),
        (
            "Contribution(0 * trace.current_a, {'soc': trace.current_a})",
            OwnEffectError,
            "a state 'soc', which the run has",
        ),
        (
            "Contribution(0 * trace.current_a, {'voltage_v': trace.current_a})",
            OwnEffectError,
            "a state 'voltage_v', which the run has",
        ),
        ("Contribution(trace.current_a / 0.0)", NoNumberError, "on_voltage gives no number at 0 s"),
        ("Contribution(trace.current_a.astype(object))", OwnEffectError, "gives values of type object"),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value", "ignore:divide by zero")
def test_what_an_effect_of_ones_own_may_not_give_is_told_with_its_file(
    tmp_path, cell, current, body, error, sentence
):
    path = tmp_path / "mine.py"
    path.write_text(OWN[: OWN.index("    return")] + f"    return {body}\n" + OWN[OWN.index("\n\nEFFECT") :])
    with pytest.raises(error, match=sentence) as caught:
        aesi.simulate(cell, TIME, current, SOC0, [load_effect(path).activate()])
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("place", "argument", "body", "error", "sentence"),
    [
        (
            "on_record", "record", "replace(record, temperature_k=np.full(len(record.time_s), 25.0))",
            OwnEffectError, "on_record gives 25 K, and a cell is at",
        ),
        (
            "on_record", "record", "replace(record, time_s=record.time_s[::-1])",
            OwnEffectError, "on_record gives times that do not rise",
        ),
        (
            "on_model", "model", "model.with_cell(contact_resistance_ohm=np.nan)",
            NoNumberError, "the voltage is no number at 0 s",
        ),
    ],
)  # fmt: skip
def test_what_an_effect_makes_of_a_record_or_a_cell_is_checked_as_what_a_user_gives(
    tmp_path, cell, current, place, argument, body, error, sentence
):
    path = tmp_path / "mine.py"
    acting = OWN[: OWN.index("def drop")] + "from dataclasses import replace\nimport numpy as np\n\n"
    acting += f"def act({argument}, *, lead_ohm):\n    return {body}\n"
    path.write_text(acting + OWN[OWN.index("\n\nEFFECT") :].replace("on_voltage=drop", f"{place}=act"))
    with pytest.raises(error, match=sentence):
        aesi.simulate(cell, TIME, current, SOC0, [load_effect(path).activate()])


@pytest.mark.parametrize("model", ["espm", "dfn"])
def test_an_effect_of_ones_own_that_leaves_the_temperature_to_the_model_had_no_impedance(
    tmp_path, cell, model
):
    path = tmp_path / "mine.py"
    acting = OWN[: OWN.index("def drop")] + "from dataclasses import replace\n\n"
    acting += "def act(record, *, lead_ohm):\n    return replace(record, temperature_k=None)\n"
    path.write_text(acting + OWN[OWN.index("\n\nEFFECT") :].replace("on_voltage=drop", "on_record=act"))
    declared_degc = cell.initial_temperature_k - ZERO_CELSIUS_K
    expected = aesi.impedance(cell, [1e-2, 1.0], 0.5, declared_degc, model=model)
    given = aesi.impedance(cell, [1e-2, 1.0], 0.5, 40.0, [load_effect(path).activate()], model=model)
    np.testing.assert_allclose(given, expected, rtol=1e-12)


def test_an_effect_of_ones_own_that_fails_on_the_cell_it_is_written_into_is_told_with_its_file(
    tmp_path, cell
):
    path = tmp_path / "mine.py"
    acting = OWN[: OWN.index("def drop")] + "def act(model, *, lead_ohm):\n    return model.cell.lead\n"
    path.write_text(acting + OWN[OWN.index("\n\nEFFECT") :].replace("on_voltage=drop", "on_model=act"))
    with pytest.raises(OwnEffectError, match="in act: AttributeError: 'Cell' object has no attribute 'lead'"):
        folded(cell, [load_effect(path).activate()])


@pytest.mark.parametrize(
    ("statement", "error", "sentence"),
    [
        ("lead_ohm / 0", NoNumberError, "ZeroDivisionError: float division by zero."),
        ("{}['lead']", OwnEffectError, "KeyError: 'lead'."),
        ("raise SystemExit(0)", OwnEffectError, "SystemExit: 0."),
        ("trace.current_a[0] = 0", OwnEffectError, "it writes into its input; make a copy first"),
        ("trace.series['soc'].sort()", OwnEffectError, "it writes into its input; make a copy first"),
    ],
)
def test_what_an_effect_of_ones_own_raises_names_file_and_line(
    tmp_path, cell, current, statement, error, sentence
):
    path = tmp_path / "mine.py"
    path.write_text(OWN.replace("    return", f"    {statement}\n    return"))
    line = path.read_text().splitlines().index(f"    {statement}") + 1
    with pytest.raises(error, match=re.escape(f"{path}, line {line}, in drop: {sentence}")) as caught:
        aesi.simulate(cell, TIME, current, SOC0, [load_effect(path).activate()])
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            "(0.0, 0.01)",
            "(0.01, 0.0)",
            "parameter 'lead_ohm': bounds [0.01, 0] ohm are empty; give low < high.",
        ),
        (
            "Parameter(1e-3",
            "Parameter(1.0",
            "parameter 'lead_ohm': default = 1 ohm is outside [0, 0.01] ohm (a lead). Give one within, or wider",
        ),
        (
            ', "a lead"',
            "",
            "parameter 'lead_ohm': TypeError: Parameter.__init__() missing 1 required positional",
        ),
        ('"ohm", (', '"", (', "parameter 'lead_ohm': the unit '' is none; give it as text, such as 'ohm'"),
        ('"ohm", (', "None, (", "parameter 'lead_ohm': the unit None is none; give it as text"),
        ('"ohm", (', '"-", (', "parameter 'lead_ohm': the unit '-' is none; give it as text"),
        ("(0.0, 0.01)", "(0.0, float('inf'))", "parameter 'lead_ohm': bounds [0, inf] ohm have no end; give"),
        (
            "Parameter(1e-3",
            "Parameter(1e-3 / 0",
            "parameter 'lead_ohm': ZeroDivisionError: float division by zero.",
        ),
    ],
)
def test_a_mistake_among_the_parameters_was_told_without_its_place(tmp_path, old, new, sentence):
    path = tmp_path / "mine.py"
    other = 'PARAMETERS = {"other_ohm": Parameter(1e-3, "ohm", (0.0, 0.01), "another"), "lead_ohm"'
    path.write_text(OWN.replace(old, new).replace('PARAMETERS = {"lead_ohm"', other))
    line = next(n for n, text in enumerate(path.read_text().splitlines(), 1) if text.startswith("PARAMETERS"))
    with pytest.raises(
        InputError, match=re.escape(f"the effect file {path} fails in line {line}, {sentence}")
    ):
        load_effect(path)


def test_a_plain_number_of_unit_1_was_shown_with_a_1_behind_it(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(OWN.replace('"ohm", (', '"1", ('))
    assert load_effect(path).parameters["lead_ohm"].unit == "dimensionless"


def test_a_failure_elsewhere_in_the_file_was_told_without_its_line(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text("import numpy\nimport nunpy\n")
    with pytest.raises(InputError, match=r"fails in line 2: ModuleNotFoundError: No module named 'nunpy'\.$"):
        load_effect(path)


def test_a_value_beyond_the_bounds_sent_users_into_the_installed_package(file):
    with pytest.raises(ParameterError, match=re.escape(f"widen the bounds in {file}.")):
        load_effect(file).activate(lead_ohm=1.0)
    with pytest.raises(ParameterError, match="an effect of your own can have wider bounds"):
        CATALOGUE["series_resistance"].activate(resistance_ohm=1e4)


def test_a_file_that_ends_python_ended_the_command_as_if_all_were_done(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text("import sys\n\nsys.exit()\n")
    with pytest.raises(InputError, match=f"the effect file {path} fails in line 3: SystemExit"):
        load_effect(path)


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("record.current_a.__iadd__(0.05); return record", "line 3, in shift: it writes into its input"),
        ("return None", "on_record gives an object of type NoneType, not a Record"),
        ("return Record(record.time_s, record.current_a[1:])", r"on_record, current_a, gives the shape"),
    ],
)
def test_an_effect_that_wrote_into_its_record_changed_it_for_all_that_read_it(tmp_path, cell, body, sentence):
    path = tmp_path / "mine.py"
    path.write_text(
        f'"""An offset."""\nfrom aesi.physics import Effect, Record\ndef shift(record): {body}\n'
        'EFFECT = Effect("shifted", "instrument", __doc__, on_record=shift)\n'
    )
    current = np.full(60, 5.0)
    with pytest.raises(OwnEffectError, match=sentence):
        aesi.simulate(cell, np.arange(60.0), current, SOC0, [load_effect(path).activate()])
    assert np.all(current == 5.0)


def test_what_a_run_gives_is_the_callers_to_write_to(cell):
    same = Effect("same", "instrument", "As it is.", on_reading=lambda trace: trace.voltage_v).activate()
    run = aesi.simulate(cell, np.arange(60.0), np.full(60, 5.0), SOC0, [same])
    assert run.voltage_v.flags.writeable


def test_an_effect_that_was_written_anew_acted_as_the_one_before(tmp_path, cell):
    path = tmp_path / "contacts.py"
    voltage = []
    for ohm in ("0.00", "0.02"):  # of one length, within a second
        path.write_text(
            '"""More ohm."""\nfrom aesi.physics import Effect\nEFFECT = Effect("contacts", "physics", __doc__, '
            f"on_model=lambda m: m.with_cell(contact_resistance_ohm={ohm}))\n"
        )
        active = load_effect(path).activate()
        voltage.append(aesi.simulate(cell, TIME, np.full(len(TIME), 5.0), 0.5, [active]).voltage_v[-1])
    assert voltage[0] - voltage[1] == pytest.approx(0.1, rel=1e-6)
    assert load_effect(path) is load_effect(str(path))


def test_two_effects_of_one_id_are_two_effects(cell):
    def contacts(ohm):
        def changed(model):
            return model.with_cell(contact_resistance_ohm=ohm)

        return Effect("contacts", "physics", "More ohm.", on_model=changed).activate()

    fresh, worn = (
        aesi.simulate(cell, TIME, np.full(len(TIME), 5.0), 0.5, [contacts(ohm)]).voltage_v[-1]
        for ohm in (0.0, 0.02)
    )
    assert fresh - worn == pytest.approx(0.1, rel=1e-6)


@pytest.mark.parametrize(
    ("place", "function", "words"),
    [
        ("on_record", lambda record: replace(record, current_a=record.current_a[1:]), "the shape .59,."),
        ("on_record", lambda record: replace(record, time_s=record.time_s[::-1]), "times that do not rise"),
        (
            "on_voltage",
            lambda trace: Contribution(trace.current_a, {"soc": trace.current_a}),
            "a state 'soc', which the run has; name it otherwise",
        ),
        ("on_voltage", lambda trace: Contribution(trace.current_a, {"own": [1.0]}), "state 'own', gives"),
        ("on_voltage", lambda trace: Contribution(1j * trace.current_a), "of type complex128, not numbers"),
        ("on_model", lambda model: model.cell, "an object of type Cell, not an EspmModel"),
    ],
)
def test_an_effect_made_in_python_went_on_with_what_one_of_a_file_is_refused_for(
    cell, place, function, words
):
    own = Effect("own", "physics", "Own.", {}, **{place: function})
    with pytest.raises(OwnEffectError, match=f"the effect 'own': {place}.*{words}"):
        aesi.simulate(cell, np.arange(60.0), np.ones(60), 0.5, effects=[own.activate()])


def test_an_effect_made_in_python_that_acts_nowhere_was_simulated_without_a_word():
    with pytest.raises(InputError, match="the effect 'own' acts nowhere; give it one of on_model"):
        Effect("own", "physics", "Own.").activate()
