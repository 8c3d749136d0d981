"""What the sparse correction explains of residuals whose cause is known, and what it points to."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
from aesi.tracer.report.yardstick import POINTS_TO, yardstick_of

CURRENT, ELECTROLYTE, SURFACES, RECENT, PAST = POINTS_TO


@pytest.fixture
def bare(cell, make):
    """The bare model's run of a record, and a function that gives what an effect changes in its voltage."""
    data = make(n=4000)
    run = simulate(cell, data.time_s, data.current_a, 0.9)

    def change(name, **values):
        effect = CATALOGUE[name].activate(**values)
        return simulate(cell, data.time_s, data.current_a, 0.9, (effect,)).voltage_v - run.voltage_v

    return run, change


def test_noise_holds_nothing_to_explain(bare, rng):
    run, _ = bare
    found = yardstick_of([run], [1e-3 * rng.normal(size=len(run.time_s))])
    assert found.explained_v < 1e-4
    assert all(pointer.share < 0.02 and not pointer.terms for pointer in found.pointers.values())


def test_an_ohmic_drop_is_explained_to_the_noise_and_points_to_the_current(bare, rng):
    run, change = bare
    drop = change("series_resistance", resistance_ohm=2e-4)
    found = yardstick_of([run], [drop + 1e-3 * rng.normal(size=len(drop))])
    assert found.explained_v == pytest.approx(np.sqrt(np.mean(drop**2)), rel=0.05)
    shares = {text: pointer.share for text, pointer in found.pointers.items()}
    assert shares[CURRENT] > 0.8
    assert shares[CURRENT] == max(shares.values())
    assert any("(I)" in term for term in found.pointers[CURRENT].terms)
    assert shares[SURFACES] < 0.3


def test_hysteresis_points_to_the_past(bare, rng):
    run, change = bare
    hysteresis = change("ocv_hysteresis", magnitude_v=0.01)
    found = yardstick_of([run], [hysteresis + 1e-3 * rng.normal(size=len(hysteresis))])
    assert found.explained_v > 0.8 * np.sqrt(np.mean(hysteresis**2))
    assert found.pointers[RECENT].share > 0.5


def test_what_is_random_but_slow_points_to_its_own_past_at_most(bare, rng):
    run, _ = bare
    steps = rng.normal(size=len(run.time_s))
    wandering = np.zeros_like(steps)
    for k in range(1, len(steps)):
        wandering[k] = 0.99 * wandering[k - 1] + 1e-3 * steps[k]
    found = yardstick_of([run], [wandering])
    assert found.explained_v < 0.6 * np.sqrt(np.mean(wandering**2))


def test_records_of_different_and_uneven_sampling_are_taken_together(cell, bare, rng):
    run, change = bare
    drop = change("series_resistance", resistance_ohm=2e-4)
    keep = np.sort(rng.choice(len(drop), 3500, replace=False))
    thin = replace(
        run,
        time_s=run.time_s[keep],
        current_a=run.current_a[keep],
        voltage_v=run.voltage_v[keep],
        series={name: column[keep] for name, column in run.series.items()},
    )
    slow_time = np.arange(0.0, 7200.0, 30.0)
    slow = simulate(cell, slow_time, np.full(len(slow_time), 3.0), 0.9)
    found = yardstick_of([thin, slow], [drop[keep], 1e-5 * rng.normal(size=len(slow_time))])
    assert found.pointers[CURRENT].share > 0.5
    assert found.explained_v < np.sqrt(np.mean(drop**2))


def test_too_few_samples_explain_nothing(cell):
    time = np.arange(30.0)
    run = simulate(cell, time, np.full(30, 3.0), 0.9)
    assert yardstick_of([run], [np.full(30, 1e-3)]).explained_v is None
