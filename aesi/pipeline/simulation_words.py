"""What is said of a profile that was simulated or predicted: where it ended, its errors, and what its band is worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.over_time import range_words, stamp
from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.physics.rest.open_circuit import GIVEN_SD
from aesi.pipeline.product.hybrid import HybridModel, id_in
from aesi.pipeline.product.prediction import Prediction
from aesi.pipeline.product.trained import percent_words, trained_figures, trained_sentence
from aesi.records import Measurement, Run

SOC_DIGITS = 3
"""Decimals of a state of charge in a note."""
VOLTAGE_DIGITS = 3
"""Decimals of a voltage in a note, V. A limit that is left by less than they show is not said to be left."""
INFERRING = frozenset(id for id, effect in CATALOGUE.items() if effect.infers == "temperature")
"""Ids of the effects whose temperature a record that holds its own does without."""
TOLD_SD = 0.01
"""Change of state of charge for which a note gives the change of the voltage. A convention."""


@dataclass(frozen=True, eq=False)
class Baseline:
    """What a prediction is compared with.

    name : of it in a sentence.  voltage_v : (n,) V, its prediction; NaN where it has none.
    how : words that say how to have its error.
    """

    name: str
    voltage_v: Array
    how: str


def effect_sentences(record: Measurement, model: HybridModel) -> list[str]:
    """A sentence on the effects that act, or that the cell holds, with their values, which may be defaults; of those
    that were fitted beside what was found the names alone. Of one name several may act: each is told. So are those
    that change nothing at their values, unless they were fitted beside what was found."""
    measured = record.temperature_degc is not None
    given = [one for one in model.effects if not (measured and one.effect.infers == "temperature")]
    acting = [repr(one) for one in given if not one.vanishes]
    held = [words for words in model.held if not (measured and id_in(words) in INFERRING)]
    told, inside = ([words for words in each if not model.was_beside(words)] for each in (acting, held))
    beside = dict.fromkeys(id_in(words) for words in (*acting, *held) if model.was_beside(words))
    said = [f"with {', '.join(told)}"] if told else []
    said += [f"the saved model includes {', '.join(inside)}"] if inside else []
    which = "and other" if said else "the saved model includes"
    said += [f"{which} parameters that were fitted together: {', '.join(beside)}"] if beside else []
    idle = [repr(one) for one in given if one.vanishes and not model.was_beside(repr(one))]
    said += [f"without effect, since of no size: {', '.join(idle)}"] if idle else []
    return [f"{record.name}: {'; '.join(said)}."] if said else []


def simulated_record_sentences(
    cell: Cell, record: Measurement, voltage_v: Array, soc: Array, baseline: Baseline | None = None
) -> list[str]:
    """Sentences on a simulated record: where it ended, its error, and how much lies outside what the file declares.

    voltage_v, soc : (n,) simulated.  baseline : what its error has to be below, where there is anything; rows that it
    does not predict count in no error. A record without a voltage has no error.
    """
    said = [
        f"{record.name}: state of charge {soc[0]:z.{SOC_DIGITS}f} at the start, {soc[-1]:z.{SOC_DIGITS}f} at the end."
    ]
    compared = np.isfinite(record.voltage_v if baseline is None else record.voltage_v + baseline.voltage_v)
    if np.all(np.isfinite(record.voltage_v)) and np.any(compared):
        error = MV_PER_V * (record.voltage_v - voltage_v)[compared]
        said.append(
            f"{record.name}: against the measured voltage {rms(error):.2f} mV RMSE, "
            f"{np.mean(error):+.2f} mV in the mean (measured minus model), at most {np.max(np.abs(error)):.1f} mV"
            f"{_baseline_clause(record.voltage_v, rms(error), baseline)}."
        )
    beyond = (soc < -GIVEN_SD) | (soc > 1.0 + GIVEN_SD)  # as closely as any is known
    unseen_v = 0.5 * 10.0**-VOLTAGE_DIGITS  # a full cell at rest is at its limit, give or take microvolts
    low, high = voltage_v < cell.lower_voltage_v - unseen_v, voltage_v > cell.upper_voltage_v + unseen_v
    limits = f"the cell's {cell.lower_voltage_v:g} to {cell.upper_voltage_v:g} V"
    left = [
        f"{side} {limit:g} V first at {stamp(record.time_s[int(np.argmax(rows))])} s, {furthest} "
        f"{voltage_v[at]:.{VOLTAGE_DIGITS}f} "
        f"V at {stamp(record.time_s[at])} s"
        for side, limit, rows, furthest, at in (
            ("below", cell.lower_voltage_v, low, "down to", int(np.argmin(voltage_v))),
            ("above", cell.upper_voltage_v, high, "up to", int(np.argmax(voltage_v))),
        )
        if np.any(rows)
    ]
    for rows, words in (
        (beyond, f"a state of charge outside 0 to 1{_beyond_limits_clause(soc)}"),
        (low | high, f"a voltage outside {limits}: {'; '.join(left)}"),
    ):
        if np.any(rows):
            said.append(f"{record.name}: {_percent(rows)} of the simulated rows have {words}.")
    return said


def baseline_of(prediction: Prediction, model: HybridModel) -> Baseline | None:
    """What a prediction has to beat: one step ahead persistence, which knows the same voltages, and in free run the
    physics without its correction; None where there is none."""
    if prediction.persistence_v is not None:
        return Baseline("persistence (the last measured error again)", prediction.persistence_v, "with it")
    if model.correction is None:
        return None
    return Baseline("the physics alone", prediction.physics_v, "without the correction")


def _baseline_clause(measured_v: Array, model_mv: float, baseline: Baseline | None) -> str:
    """Clause, from '; ' on, on the error of the baseline where it predicts, and on that being the smaller one."""
    if baseline is None:
        return ""
    error = MV_PER_V * (measured_v - baseline.voltage_v)
    theirs, ours = f"{rms(error[np.isfinite(error)]):.2f}", f"{model_mv:.2f}"
    better = f": {baseline.how} the error on this record is lower" if float(theirs) < float(ours) else ""
    return f"; {baseline.name} {theirs} mV RMSE{better}"


def _beyond_limits_clause(soc: Array) -> str:
    """A clause, beginning with ': ', on how far a record discharges or charges a cell beyond its limits.  soc : (n,)
    simulated."""
    said = []
    if (low := -float(np.min(soc))) > GIVEN_SD:
        asks = (
            "starts with less charge than an empty cell"
            if soc[0] == np.min(soc)
            else "asks for more charge than the cell has"
        )
        said.append(f"{asks}, by {100 * low:.1f} % of its capacity")
    if (high := float(np.max(soc)) - 1.0) > GIVEN_SD:
        asks = "starts with" if soc[0] == np.max(soc) else "brings"
        said.append(f"{asks} more charge than the cell can hold, by {100 * high:.1f} %")
    return f": the record {' and '.join(said)}" if said else ""


def voltage_words(run: Run) -> str:
    """Range of a run's voltage, '2.5 to 4.1 V'; of one that went on where it ran out, the range until then, and
    beyond."""
    voltage, depleted = run.voltage_v, run.series.get("depleted")
    if depleted is None or not np.any(depleted):
        return _range_v(voltage)
    at = int(np.argmax(depleted))
    until = f"{_range_v(voltage[:at])} until" if at else "no row before"
    return f"{until} it ran out at {stamp(run.time_s[at])} s, {_range_v(voltage[at:])} beyond, of no cell"


def changed_cell_sentences(record: Measurement, model: HybridModel, soc0: float, soc: Array) -> list[str]:
    """A sentence where effects of the model change what the electrodes hold between empty and full, so that a state of
    charge is not that of the cell file.

    soc0 : at the first row, of the cell file.  soc : (n,) simulated, of the cell with its effects.
    """
    if abs(float(soc[0]) - soc0) < 0.5 * 10.0**-SOC_DIGITS:
        return []
    names = ", ".join(active.id for active in model.effects)
    return [
        f"{record.name}: the {soc0:.{SOC_DIGITS}f} it starts at is of the cell file; the cell with its effects "
        f"({names}) rests at the same voltage at {soc[0]:.{SOC_DIGITS}f}, and all states of charge are of that."
    ]


def _range_v(voltage_v: Array) -> str:
    return f"{range_words(f'{np.min(voltage_v):.3f}', f'{np.max(voltage_v):.3f}')} V"


def first_error_sentences(
    record: Measurement, prediction: Prediction, model: HybridModel, measured: bool
) -> list[str]:
    """A sentence on the error that a free run of a corrected model begins with."""
    if measured or model.correction is None:
        return []
    error_v = float(record.voltage_v[0] - prediction.physics_v[0])
    if np.isfinite(error_v):
        side = "below" if error_v < 0.0 else "above"
        return [
            f"{record.name}: its first voltage is {MV_PER_V * abs(error_v):.1f} mV {side} the model's; the prediction "
            "starts with that error."
        ]
    words = "the prediction starts with the error that the correction predicts, since no voltage is measured there"
    return [f"{record.name}: {words}; the band is that of a whole drive from its first row on."]


def exact_start_sentence(record: Measurement, prediction: Prediction, model: HybridModel, soc0: float) -> str:
    """A sentence that a band around a given start does not include an error of the start."""
    worth_v = model.start_worth_v(record, soc0, TOLD_SD, prediction.physics_v)
    return (
        f"{record.name}: the band takes the initial state of charge of {soc0:.4g} as exact; an error of {TOLD_SD:g} in "
        f"it changes the voltage by {MV_PER_V * rms(worth_v):.1f} mV RMS along this record. --soc0-sd, beside "
        "--soc0, widens the band by the uncertainty of the initial state."
    )


def band_sentences(
    record: Measurement, prediction: Prediction, model: HybridModel, measured: bool
) -> list[str]:
    """Sentences on where the correction is applied, and on the share of rows within its band."""
    if model.correction is None:
        empty = ", and lower_v and upper_v are empty" if prediction.nominal is None else ""
        said = [
            f"the model carries no learnt correction: one step ahead it predicts the voltage of a free run{empty}."
        ]
    else:
        figures = trained_figures(
            prediction.outside,
            prediction.temperature_degc,
            model.correction,
            model.visited,
            prediction.weight,
        )
        starts = bool(np.isfinite(record.voltage_v[0]))
        said = [trained_sentence(record.name, figures, one_step=measured, first_measured=starts)]
        if prediction.diverged_s is not None:
            said.append(
                f"{record.name}: the correction, which feeds its own prediction back, diverges at "
                f"{stamp(prediction.diverged_s)} s and is held at its last value from there on: do not use the voltage "
                "after that."
            )
    banded = np.isfinite(prediction.lower_v)
    if prediction.nominal is not None and np.all(np.isfinite(record.voltage_v)):
        low, high = prediction.lower_v[banded], prediction.upper_v[banded]
        inside = float(np.mean(_within(record.voltage_v[banded], low, high)))
        said.append(
            f"{record.name}: the {100 * prediction.nominal:g} % band holds {100 * inside:.1f} % of the "
            f"measured voltage; it is {MV_PER_V * float(np.mean(high - low)):.1f} mV wide in the mean."
        )
        if measured:
            said += _one_step_band_sentences(record, model, ~_within(prediction.voltage_v[banded], low, high))
        else:
            said += _unlike_trained_sentences(record, model, inside)
    return said


def _unlike_trained_sentences(record: Measurement, model: HybridModel, inside: float) -> list[str]:
    """A sentence where a band of a free run holds less of a record than of every piece of the training records, each
    predicted by a model that was fitted without it.  inside : share of the record's rows within the band."""
    if model.bands is None:
        return []
    left_out = model.bands.horizons[-1].by_piece
    if inside >= min(left_out):
        return []
    return [
        f"{record.name}: that is less than of any of the {len(left_out)} left-out pieces of the training records "
        f"({100 * min(left_out):.1f} % or more): this record is further from the model than they are. Check that it is "
        "of this cell at this age, and that its initial state of charge and its temperature are right."
    ]


def _one_step_band_sentences(record: Measurement, model: HybridModel, apart: BoolArray) -> list[str]:
    """Sentences on predictions outside a band one step ahead, and on rows further apart than its step.

    apart : True for those of the rows with a band that are predicted outside it.
    """
    said = []
    if np.any(apart):
        said.append(
            f"{record.name}: in {_percent(apart)} of the rows voltage_v lies outside its own band, which follows the "
            "errors of the rows before; the middle of lower_v and upper_v is the better estimate there."
        )
    if np.any(gaps := model.after_gap(record.time_s)):
        said.append(
            f"{record.name}: {_percent(gaps)} of the rows are more than a step of {model.dt_s:g} s after the one "
            "before, from which they are predicted; the band is of a step."
        )
    return said


def _within(voltage_v: Array, lower_v: Array, upper_v: Array) -> BoolArray:
    """(n,) True where a voltage lies in its band."""
    return (voltage_v >= lower_v) & (voltage_v <= upper_v)


def _percent(rows: BoolArray) -> str:
    """The share of True rows, '3.2 %'."""
    return percent_words(100.0 * float(np.mean(rows)))
