"""Records of one cell at several ages, and what a fit says of ordinary use."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.physics import simulate
from aesi.records import Measurement
from aesi.tracer import discover
from aesi.tracer.case.blocks import blocks_of
from aesi.tracer.case.free_parameter import CAPACITY_SHARE
from aesi.tracer.case.problem import SHARE_SD, InverseProblem, record_capacity_share
from aesi.tracer.case.records import prepare_all, prepare_test
from aesi.tracer.decide.carry_over import LeftOut
from aesi.tracer.decide.evidence import of_several_ages
from aesi.tracer.decide.model_to_write import Option
from aesi.tracer.decide.prediction_in_use import predicted_share_in_use
from aesi.tracer.likelihood.model_error import MEASURED_V
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.report.own_parameters import ages_told, own_parameters
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.hypothesis_fits import base_of, values_without


@pytest.fixture(scope="module")
def discharge(cell):
    """measurement(share of the capacity that the cell had, state of charge at the end): from full, at 1C."""

    def measurement(share=1.0, until=0.03, name="made"):
        time = np.arange(0.0, 3600.0 * (1.0 - until) * share, 4.0)
        current = np.full(len(time), cell.nominal_capacity_ah)
        voltage = simulate(cell.with_material(share), time, current, 1.0).voltage_v
        noise = 1e-3 * np.random.default_rng(1).normal(size=len(time))
        return Measurement(time, current, voltage + noise, name=name)

    return measurement


def fitted(cell, few, records, trust):
    problem = InverseProblem(cell, prepare_all(cell, records, 1.0, 0.0), few, trust=trust, ages=True)
    blocks = blocks_of(problem)
    return problem, blocks, base_of(problem, blocks, Archive(None, ""))


def test_each_of_several_records_of_a_measured_cell_has_a_capacity_of_its_own(cell, few, discharge):
    records = [discharge(0.96, name="later"), discharge(name="first")]
    problem, blocks, fit = fitted(cell, few, records, "loose")
    assert record_capacity_share(fit.values, 0) / record_capacity_share(fit.values, 1) == pytest.approx(
        0.96, abs=4e-3
    )
    state = ModelState.of(problem, fit)
    runs = [state.simulated(one, k, thin=False) for k, one in enumerate(problem.records)]
    left = [
        np.sqrt(np.mean((run.voltage_v - one.voltage_v) ** 2)) for run, one in zip(runs, records, strict=True)
    ]
    assert max(left) < 1.5e-3
    told = {one.name: one.value for one in own_parameters(state) if one.owner == CAPACITY_SHARE}
    assert told == {
        "later": record_capacity_share(fit.values, 0),
        "first": record_capacity_share(fit.values, 1),
    }
    declared = ModelState(problem)
    assert ages_told((declared,)) == ""
    assert f"{told['later']:.3f} in later, {told['first']:.3f} in first" in ages_told((declared, state))
    without = values_without(problem, blocks, fit, blocks.folds["record"][0])
    assert record_capacity_share(without, 0) == pytest.approx(
        1.0, abs=1e-4
    )  # nothing but its own rows tells it
    held = replace(problem, trust="tight")
    assert not any(one.owner == CAPACITY_SHARE for one in held.free(()))
    assert sum(one.owner == CAPACITY_SHARE and one.sd == SHARE_SD for one in problem.free(())) == 2


def test_what_continues_a_record_goes_on_in_its_state(cell, few, discharge):
    whole = discharge(0.96, name="later")
    records = [discharge(name="first"), whole.between(0.0, 1700.0)]
    problem, _, fit = fitted(cell, few, records, "loose")
    rest = prepare_test(cell, whole.between(1700.0, 4000.0), records, 1.0)
    assert (rest.continues, rest.lead_rows) == (1, len(records[1]))
    state = ModelState.of(problem, fit)

    def left_v(record):
        run = state.simulated(record, None, thin=False)
        return np.sqrt(np.mean((run.voltage_v - record.data.voltage_v)[rest.lead_rows : -20] ** 2))

    assert left_v(rest) < 0.5 * left_v(replace(rest, continues=None))


def test_errors_were_told_of_a_model_of_several_ages_that_nobody_can_write(cell, few, discharge):
    records = [discharge(0.9, name="later"), discharge(name="first")]
    own = {name: few[name] for name in ("voltage_sensor_offset", "solid_diffusivity")}
    found = discover(cell, records, soc0=1.0, holdout=0.0, effects=own, model="espm", max_effects=0)
    assert any(
        "later" in note and "the written model has the file's capacity" in note for note in found.notes
    )
    values = {(one.owner, one.name): one.value for one in found.own["recalibrated"]}
    assert values[CAPACITY_SHARE, "later"] == pytest.approx(0.9, abs=0.03)
    effects = [
        effect.activate_only(**{name: values[effect.id, name] for name in effect.parameters})
        for effect in own.values()
    ]
    for told, record in zip(found.files, records, strict=True):
        soc0 = values["soc0", record.name]
        run = simulate(cell, record.time_s, record.current_a, soc0, effects, hold=record.hold_taken)
        assert told.voltages["recalibrated"] == pytest.approx(run.voltage_v, abs=1e-6)


def test_of_one_record_alone_what_the_cell_has_lost_is_left_to_effects(cell, few, discharge):
    problem, _, fit = fitted(cell, few, [discharge(0.98)], "loose")
    assert not any(one.owner == CAPACITY_SHARE for one in problem.free(()))
    assert record_capacity_share(fit.values, 0) == 1.0


def test_records_are_of_several_ages_where_they_say_so(cell, few, discharge):
    def told(share):
        records = prepare_all(cell, [discharge(share, name="later"), discharge(name="first")], 1.0, 0.0)
        return of_several_ages(InverseProblem(cell, records, few), Archive(None, ""))

    assert told(0.96)
    assert not told(1.0)


def test_what_says_nothing_of_ordinary_use_is_not_written(cell, few, discharge):
    half = [discharge(until=0.5), discharge(until=0.45)]
    problem, blocks, fit = fitted(cell, few, half, "loose")
    untold = replace(fit, point=replace(fit.point, jacobian_v=1e-9 * fit.point.jacobian_v))
    share, as_believed = (predicted_share_in_use(problem, blocks, one, MEASURED_V) for one in (fit, untold))
    assert as_believed < 0.5 < share < 1.0
    assert predicted_share_in_use(problem, blocks, untold, 10.0) == pytest.approx(1.0, abs=1e-3)
    declared = Option.of(problem, blocks, None)
    assert Option.of(problem, blocks, fit).tested(declared.usual_error_v)
    assert not Option.of(problem, blocks, untold).tested(declared.usual_error_v)
    volts_off = replace(declared, left_out=LeftOut((10.0, 10.0), (10.0,)))
    assert Option.of(problem, blocks, untold).tested(volts_off.usual_error_v)  # it may err by as much
    nowhere = replace(declared, left_out=LeftOut((10.0, np.inf), (10.0,)))
    assert not Option.of(problem, blocks, untold).tested(nowhere.usual_error_v)
