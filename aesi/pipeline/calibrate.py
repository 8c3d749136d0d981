"""`aesi calibrate` as plain functions: measurements in; a calibrated BPX file and its report out."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from aesi.calibration import Calibration, Conditions, calibrate
from aesi.calibration.fit import OnStep
from aesi.calibration.parameters import check_names
from aesi.calibration.records.prepared import check_flows, with_temperatures
from aesi.calibration.records.sizes import sizes_sentence
from aesi.calibration.records.spectra import BAND_HZ, check_spectra
from aesi.calibration.result import RecordError
from aesi.calibration.start import full_discharge_numbers, scaled_to_discharge
from aesi.calibration.uncertainty.health import HEALTH_WORDS, health_intervals, health_of
from aesi.calibration.uncertainty.posterior import PosteriorSamples, check_posterior, sample_posterior
from aesi.calibration.uncertainty.pulse_resistance import PULSE_S, pulse_resistance
from aesi.calibration.written_cell import fit_states, start_soc
from aesi.constants import CM_PER_M, MILLI, MV_PER_V, ZERO_CELSIUS_K
from aesi.errors import DataError, InputError
from aesi.numerics.files.whole import write_whole
from aesi.over_time import stamp
from aesi.physics.arguments import check_temperature
from aesi.physics.cell import Cell
from aesi.physics.cell.bpx.values import check_values
from aesi.physics.cell.energies import SPAN_K
from aesi.physics.record_checks import check_measured
from aesi.physics.simulation import MODEL_WORDS
from aesi.pipeline.distinct import check_distinct, check_distinct_spectra
from aesi.pipeline.impedance import SpectrumError, compared_spectra
from aesi.pipeline.notes import together
from aesi.pipeline.product.declared import Declared, declared_model
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.report.views import DiscoveryTrace
from aesi.pipeline.report.words.calibrations import open_line, to_text
from aesi.pipeline.written import calibration_files
from aesi.records import Measurement, Spectrum
from aesi.tracer.case.checks import SHORTEST_S

SCHEMA = "aesi.calibration/2"
ROUND_OFF = 1e-9
"""Share of a quantity: an interval narrower than this is none, since no parameter of the fit moves the quantity."""


@dataclass(frozen=True)
class Request:
    """A request for a calibration, beside its records.

    conditions : of the records. Where they name no model, the model of a saved model is fitted, or the one that the
    file was fitted with, else "espm".
    impedance : spectra to hold the result against, beside those among the conditions, which are fitted.
    cut_offs_v : (lower, upper) V between which the records' cell is cycled; None takes those of the file.
    posterior : steps of each walker, 0 for none.  starts : number of fits, see `aesi.calibration.calibrate`.
    seed : of the posterior's samples and of the drawn starts.
    title : name of the cell that is written.
    body_mm, mass_g : of the records' cell, as for `Cell.with_body`; None takes those of the file.
    """

    conditions: Conditions = field(default_factory=Conditions)
    impedance: tuple[Spectrum, ...] = ()
    cut_offs_v: tuple[float, float] | None = None
    posterior: int = 0
    starts: int = 1
    seed: int = 0
    title: str | None = None
    body_mm: Sequence[float] | None = None
    mass_g: float | None = None


def check_request(cell: Declared, request: Request) -> None:
    """Raises CellError, DataError or InputError, one sentence, for a request that can be refused without a record."""
    if request.title is not None and not request.title.strip():
        raise InputError(
            "--title is empty; give the cell a name, or leave it out for that of the start file."
        )
    check_posterior(request.posterior)
    check_distinct_spectra(request.conditions.spectra, request.impedance)
    given = declared_model(cell).cell
    start = start_cell(given, request.cut_offs_v, request.body_mm, request.mass_g)
    check_names(start, request.conditions.priors)


def start_cell(
    cell: Cell,
    cut_offs_v: tuple[float, float] | None,
    body_mm: Sequence[float] | None,
    mass_g: float | None,
) -> Cell:
    """The cell that a calibration starts from, between (lower, upper) V and with the body where these are given.

    Raises CellError for cut-offs or a body that no cell has.
    """
    placed = cell if cut_offs_v is None else cell.with_cut_offs(*cut_offs_v)
    return placed.with_body(body_mm, mass_g)


def body_sentences(cell: Cell, start: Cell) -> tuple[str, ...]:
    """A sentence on the body that was given for the cell of a file; empty where none was.

    start : the cell that the calibration starts from, at its size.  Raises CellError where the body holds no such cell.
    """
    if (start.volume_m3, start.density_kg_m3) == (cell.volume_m3, cell.density_kg_m3):
        return ()
    check_values(start, f"{start.name} in the body that was given")
    values = [
        f"{value * to_unit:.4g} {unit}"
        for value, to_unit, unit in (
            (start.volume_m3, CM_PER_M**3, "cm3"),
            (start.surface_area_m2, CM_PER_M**2, "cm2"),
            (start.density_kg_m3, 1.0, "kg/m3"),
        )
        if value is not None
    ]
    return (f"the body of the cell as given: {', '.join(values)}.",)


def calibrate_declared(
    given: HybridModel, measurements: Sequence[Measurement], asked: Request, on_step: OnStep | None = None
) -> Calibration:
    """Calibrate the cell of a declared model to records, after every check that needs no fit; its notes begin with what
    is left out of what is declared, and with the body that was given.

    on_step : told at each step of the fit.

    Raises CellError, DataError or InputError, one sentence, for what cannot be used.
    """
    check_request(given, asked)
    conditions = asked.conditions
    check_records(measurements, conditions.temperatures_degc)
    declared = start_cell(given.cell, asked.cut_offs_v, asked.body_mm, asked.mass_g)
    start = start_at_size(declared, measurements, conditions.temperatures_degc)
    body = body_sentences(given.cell, start)
    check_spectra(start, (*conditions.spectra, *asked.impedance))
    found = calibrate(
        declared,
        measurements,
        replace(conditions, model=conditions.model or given.model),
        starts=asked.starts,
        seed=asked.seed,
        on_step=on_step,
    )
    return replace(found, notes=(*omitted_effect_sentences(given), *body, *found.notes))


def calibrate_files(
    cell: Path,
    measurements: Sequence[Measurement],
    out: Path,
    request: Request | None = None,
    on_step: OnStep | None = None,
) -> dict[str, Any]:
    """Calibrate the cell of a BPX file; writes `out` (BPX) and the report beside it, and returns the report.

    on_step : told at each step of the fit.

    Raises CellError, DataError or InputError, one sentence, for what cannot be used.
    """
    asked = request or Request()
    found = calibrate_declared(declared_model(cell), measurements, asked, on_step)
    name = found.declared.name if asked.title is None else asked.title
    found = replace(found, cell=replace(found.cell, name=name, description=_provenance(found)))
    posterior = sample_posterior(found, asked.posterior, asked.seed) if asked.posterior else None
    spectra, spectrum_notes = compared_spectra(
        found.cell, asked.impedance, model=found.model.model_name, fitted=asked.conditions.spectra
    )
    read = [note for m in measurements for note in m.notes]
    content = calibration_content(found, [*read, *spectrum_notes], posterior, spectra)
    cell_file, data, text, page = calibration_files(out)
    write_whole(cell_file, json.dumps(found.cell.to_bpx(), indent=1, allow_nan=False) + "\n")
    write_whole(data, json.dumps(content, indent=1, allow_nan=False) + "\n")
    write_whole(text, to_text(content))
    _write_page(page, found, content, spectra)
    return content


def _write_page(
    path: Path, found: Calibration, content: Mapping[str, Any], spectra: Sequence[SpectrumError]
) -> None:
    from aesi.pipeline.report.calibration import CalibrationView, write_calibration_report

    words = MODEL_WORDS[found.model.model_name]
    view = CalibrationView(
        content, words, fit_traces(found), HEALTH_WORDS, open_line(content), tuple(spectra)
    )
    write_calibration_report(path, view)


def fit_traces(found: Calibration) -> tuple[DiscoveryTrace, ...]:
    """Each record's rows with the voltage of the start file, of the file as it is simulated, and as fitted.

    The state of charge is counted from the fitted start, both in the windows and of the capacity that the written cell
    had when the record was measured.
    """
    model, x = found.model, found.x
    states = fit_states(model, found.declared, x)
    out = []
    for i, record in enumerate(model.records):
        rows = record.rows
        start, simulated, fitted = (
            model.run(i, *states[name]).voltage_v for name in ("declared", "simulated", "fitted")
        )
        capacity_ah = found.cell.capacity_ah * found.capacities[record.name]
        soc = start_soc(model, x, i) - rows.discharged_ah(record.hold) / capacity_ah
        out.append(
            DiscoveryTrace(
                record.name,
                "fit",
                rows.time_s,
                rows.current_a,
                soc,
                rows.voltage_v,
                start,
                simulated,
                fitted,
                record.hold,
            )
        )
    return tuple(out)


def omitted_effect_sentences(given: HybridModel) -> tuple[str, ...]:
    """Sentences on what a fit leaves out of a cell or a saved model: what its file declares and no simulation takes,
    and the model's effects."""
    if not given.effects:
        return given.cell.unread
    names = ", ".join(effect.id for effect in given.effects)
    what = "the effect" if len(given.effects) == 1 else "the effects"
    return (
        *given.cell.unread,
        f"{what} {names} of the saved model: left out, since what is fitted and written is what a cell's file holds.",
    )


def check_records(measurements: Sequence[Measurement], temperatures_degc: Mapping[str, float] | None) -> None:
    """Raises DataError for a record that is given twice, is too short or holds no current, InputError for a
    temperature that no cell has."""
    check_distinct(measurements)
    for record in measurements:
        span_s = float(np.ptp(record.time_s)) if len(record) else 0.0
        if span_s < SHORTEST_S:
            raise DataError(
                f"{record.name} lasts {stamp(span_s)} s, in which neither diffusion nor the slope of the open-circuit "
                f"voltage shows; give records of at least {SHORTEST_S:g} s."
            )
        check_flows(record)
    for name, value in (temperatures_degc or {}).items():
        check_temperature(value, f"the temperature of {name}")
        if np.ndim(value):
            raise InputError(
                f"the temperature of {name} is a row of {len(value)}; give one number here, or the record a column."  # type: ignore[arg-type]
            )


def start_at_size(
    declared: Cell, measurements: Sequence[Measurement], temperatures_degc: Mapping[str, float] | None
) -> Cell:
    """The start cell at the size that the records indicate, which need not be that of its file.

    temperatures_degc : of records without a column, by name.  Raises DataError for a record that cannot be of it, at
    its temperature.
    """
    start = scaled_to_discharge(declared, measurements)[0]
    placed = with_temperatures(start, measurements, temperatures_degc or {})[0]
    try:
        check_measured(start, placed, full_discharge_numbers(declared, measurements))
    except DataError as error:
        if not (sizes := sizes_sentence(declared, measurements)):
            raise
        # Else a record is refused for the size that another one gave the cell, as if its file had it.
        raise DataError(f"{sizes.removesuffix('.')}; calibrate them by themselves.") from error
    return start


def _provenance(found: Calibration) -> str:
    """The description of a calibrated file: what it was fitted to, and with which model."""
    records = ", ".join(e.name for e in found.errors)
    with_model = MODEL_WORDS[found.model.model_name]
    return f"Fitted by aesi calibrate with {with_model} to {records}, from {found.declared.name}."


def calibration_content(
    found: Calibration,
    read: Sequence[str] = (),
    posterior: PosteriorSamples | None = None,
    spectra: Sequence[SpectrumError] = (),
) -> dict[str, Any]:
    """The report: errors by file, parameters with intervals, what stays open.

    read : notes before those of the fit: what a reader dropped, mapped or averaged.
    """
    sampled_notes = () if posterior is None else (posterior.sentence,)
    told = (note for note in (*read, *found.notes, *sampled_notes) if note != found.size_assumed)
    return {
        "schema": SCHEMA,
        "cell": found.cell.name,
        "model": found.model.model_name,
        "files": [_file_row(e, found.capacities[e.name], found.starts[e.name]) for e in found.errors],
        "parameters": _parameter_rows(found, posterior),
        "capacity_ah": found.cell.capacity_ah,
        "declared_capacity_ah": found.declared.capacity_ah,
        "declared_degc": found.declared.initial_temperature_k - ZERO_CELSIUS_K,
        "health": _health_rows(found),
        "pulse_resistance": _pulse_resistance(found),
        "size_assumed": found.size_assumed,
        "undetermined": [
            {"weights": dict(o.weights), "narrowed": o.narrowed, "sentence": o.sentence}
            for o in found.undetermined
        ],
        "impedance": [_spectrum_row(s) for s in spectra],
        "at_bounds": list(found.at_bounds),
        "warnings": list(found.warnings),
        "notes": list(together(told, [e.name for e in found.errors])),
        "seconds": round(found.seconds, 2),
    }


def _file_row(error: RecordError, capacity_share: float, soc0: float) -> dict[str, Any]:
    return {
        "name": error.name,
        "temperature_degc": error.temperature_degc,
        "before_rmse_mv": MV_PER_V * error.before_v,
        "after_rmse_mv": MV_PER_V * error.after_v,
        "as_simulated_rmse_mv": MV_PER_V * error.simulated_v,
        "ran_out_s": error.ran_out_s,
        "until_ran_out_rmse_mv": error.until_mv,
        "capacity_share": capacity_share,
        "soc0": soc0,
    }


def _parameter_rows(found: Calibration, posterior: PosteriorSamples | None) -> dict[str, dict[str, Any]]:
    deviations = np.sqrt(np.diag(found.covariance))  # the working vector is in deviations of the priors
    left = dict(zip((free.name for free in found.model.free), deviations.tolist(), strict=False))
    return {
        name: {
            "value": p.value,
            "low": p.low,
            "high": p.high,
            "unit": p.unit,
            "prior_from": p.source,
            "of_prior": left.get(name),
            **_posterior_bounds(posterior, name),
        }
        for name, p in found.parameters.items()
    }


def _spectrum_row(held: SpectrumError) -> dict[str, Any]:
    return {
        "name": held.measured.name,
        "soc": held.soc,
        "temperature_degc": held.measured.temperature_degc,
        "rms_pct": None if held.ratio_error is None else 100.0 * held.ratio_error,
        "band_hz": list(BAND_HZ),
        "fitted": held.fitted,
    }


def _health_rows(found: Calibration) -> dict[str, dict[str, float | None]]:
    """Each quantity with its interval; without one where no parameter of the fit moves it."""
    intervals = health_intervals(found)
    rows: dict[str, dict[str, float | None]] = {}
    for name, value in asdict(health_of(found.cell)).items():
        low, high = intervals[name]
        fitted = high - low > ROUND_OFF * abs(value)
        rows[name] = {"value": value, "low": low if fitted else None, "high": high if fitted else None}
    return rows


def _pulse_resistance(found: Calibration) -> dict[str, Any]:
    """The resistance of a pulse in mohm, a row a temperature; None where the cell cannot give the pulse there.

    `fitted` of a row: whether its temperature is between those of the records, or within `SPAN_K` of one.
    """
    told = pulse_resistance(found)
    fitted_degc = [kelvin - ZERO_CELSIUS_K for _, kelvin in found.cell.fitted_at_k]
    columns = {"mohm": told.ohm, "low_mohm": told.low_ohm, "high_mohm": told.high_ohm}
    rows = [
        {
            "temperature_degc": degc,
            "fitted": min(fitted_degc) - SPAN_K <= degc <= max(fitted_degc) + SPAN_K,
            **{key: [MILLI * v if np.isfinite(v) else None for v in ohm[k]] for key, ohm in columns.items()},
        }
        for k, degc in enumerate(told.temperature_degc.tolist())
    ]
    measured = [
        {"record": p.record, "temperature_degc": p.temperature_degc, "soc": p.soc, "mohm": MILLI * p.ohm}
        for p in told.measured
    ]
    return {
        "seconds": PULSE_S[-1],
        "soc": told.soc.tolist(),
        "rows": rows,
        "measured": measured,
        "left_out": dict(told.left_out),
        "model_error_pct": None if told.model_error is None else 100.0 * told.model_error,
    }


def _posterior_bounds(posterior: PosteriorSamples | None, name: str) -> dict[str, float]:
    if posterior is None:
        return {}
    interval = posterior.intervals[name]
    return {"posterior_low": interval.low, "posterior_high": interval.high}
