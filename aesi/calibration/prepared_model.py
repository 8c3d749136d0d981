"""The model that a calibration fits, set up from a start file, records and conditions, with sentences on each step."""

from __future__ import annotations

from collections.abc import Sequence

from aesi.calibration.ageing import Ageing
from aesi.calibration.model import Model
from aesi.calibration.parameters import free_parameters, with_interfaces, with_parameters, with_priors
from aesi.calibration.records.conditions import Conditions
from aesi.calibration.records.named import uniquely_named
from aesi.calibration.records.prepared import (
    check_flows,
    fitted_rows_sentence,
    kelvin_taken,
    prepared,
    with_temperatures,
)
from aesi.calibration.records.sizes import other_sizes, sizes_sentence
from aesi.calibration.records.spectra import degc_of, fitted_spectra
from aesi.calibration.records.thinning import thinned
from aesi.calibration.records.zero import Zero, zero_of
from aesi.calibration.shapes import Shapes
from aesi.calibration.start import (
    activation_sentences,
    discharge_branch,
    full_discharge_numbers,
    scaled_to_discharge,
    with_activation,
    with_unmoved_energies,
)
from aesi.constants import ZERO_CELSIUS_K
from aesi.errors import DataError
from aesi.physics.cell import Cell
from aesi.physics.cell.energies import SPAN_K
from aesi.physics.record_checks import check_voltage, other_materials_sentence
from aesi.physics.start.charge import check_charge
from aesi.records import Measurement, Spectrum, measured_on_case
from aesi.records.checked import check_row

FEWEST_ROWS = 2
"""Of a record: one row has no time in which a current flows."""
OF_ROWS_LEFT_OUT = (
    "the state of charge that was given is that of its first row, which is not fitted; it starts where its "
    "voltage says."
)


def prepared_model(
    cell: Cell, records: Sequence[Measurement], conditions: Conditions
) -> tuple[Model, tuple[str, ...]]:
    """(model that is fitted, sentences on how it was set up, in the order of the steps).

    Raises DataError for records that do not fit the cell.
    """
    records = _checked_records(cell, records, conditions)
    start, zero, size_sentences = _size_and_zero(cell, records, conditions.same_cell)
    branches = [discharge_branch(start, data) for data in records]
    at_temperatures, temperature_sentences = with_temperatures(
        start, [data for data, _ in branches], conditions.temperatures_degc
    )
    declared, start = start, with_activation(start)
    full_discharges = () if conditions.same_cell else full_discharge_numbers(cell, records)
    # Their capacity is not the one that the largest full discharge shows.
    smaller = other_sizes(cell, records)
    of_size = (records[i] for i in full_discharges if records[i].name not in smaller)
    potential_sentences = filter(None, (other_materials_sentence(start, record) for record in of_size))
    cut = [whole for r, whole in zip(at_temperatures, records, strict=True) if r.time_s[0] > whole.time_s[0]]
    cut_names = [whole.name for whole in cut]
    model_name = conditions.model or "espm"
    rows = [thinned(data, start.capacity_ah) for data in at_temperatures]
    spectra, spectrum_sentences = fitted_spectra(start, conditions.spectra)
    span = _span_k(start, [one.data for one in rows], spectra)
    degc = (one.data.temperature_degc for one in rows)
    on_case = any(one is not None and measured_on_case(one) for one in degc)
    start = with_interfaces(start, on_case)
    if span <= SPAN_K:
        start = with_unmoved_energies(declared, start, conditions.same_cell)
    free = with_priors(free_parameters(start, span, conditions.same_cell, on_case), conditions.priors)
    # A voltage under load tells the charge of the cell that the fit starts from, with its films, contacts and energies.
    first_cell = with_parameters(start, {one.name: one.start for one in free})
    prepared_records = prepared(
        first_cell, at_temperatures, rows, conditions.soc0, model_name, conditions.same_cell, cut_names
    )
    for one in prepared_records:
        check_charge(start, one.rows, one.start.soc, one.hold)
    energies = {f.name: (f.start, f.sd) for f in free if f.name.endswith("_energy")}
    ageing = Ageing.of(prepared_records, conditions.dates, conditions.as_of)
    model = Model(
        start,
        prepared_records,
        free,
        Shapes.over(start, span),
        zero,
        ageing,
        model_name,
        spectra,
    )
    return model, (
        *size_sentences,
        *filter(None, [sizes_sentence(cell, records)]),
        *potential_sentences,
        *zero.sentences,
        *(sentence for _, branch_sentences in branches for sentence in branch_sentences),
        *temperature_sentences,
        *(f"{r.name}: {OF_ROWS_LEFT_OUT}" for r in cut if conditions.soc0 is not None or r.soc0 is not None),
        *_small_span_sentences(span, len(prepared_records)),
        *activation_sentences(declared, start, energies, [f.name for f in free if f.given]),
        *(r.start.sentence for r in prepared_records if not r.start.against_voltage),  # those are warnings
        *spectrum_sentences,
        *map(fitted_rows_sentence, prepared_records),
        *ageing.sentences,
    )


def _checked_records(
    cell: Cell, records: Sequence[Measurement], conditions: Conditions
) -> tuple[Measurement, ...]:
    """The records with names of their own.

    Raises DataError where there is none, and for one that has too few rows, lacks a voltage or a current, or is no
    record of the cell.
    """
    if not records:
        raise DataError("give at least one record to calibrate with.")
    named = uniquely_named(records, {"temperature": conditions.temperatures_degc, "date": conditions.dates})
    for record in named:
        if len(record) < FEWEST_ROWS:
            raise DataError(
                f"{record.name} has too few rows ({len(record)}) to be fitted; a record needs at least {FEWEST_ROWS}."
            )
        check_row(record.voltage_v, f"{record.name}: voltage_v")
        check_voltage(cell, record)
        check_flows(record)
    return named


def _size_and_zero(
    cell: Cell, records: Sequence[Measurement], same_cell: bool
) -> tuple[Cell, Zero, tuple[str, ...]]:
    """(cell of the size that the records indicate, zero offset of their cycler's current, sentences on the size).

    Each needs the other: a first size gives the offset, and currents without the offset give the final size.
    """
    if same_cell:
        return cell, zero_of(cell, records), ()
    roughly, _ = scaled_to_discharge(cell, records)
    zero = zero_of(roughly, records)
    start, sentences = scaled_to_discharge(
        cell, [zero.subtracted_from(r, roughly.nominal_capacity_ah) for r in records]
    )
    return start, zero, sentences


def _small_span_sentences(span_k: float, n_records: int) -> tuple[str, ...]:
    """A sentence where the records span too few kelvin to determine the temperature dependence; else empty."""
    if span_k > SPAN_K:
        return ()
    apart = (
        f"the mean temperatures of the records are {span_k:.1f} K apart, less than {SPAN_K:g} K"
        if n_records > 1
        else "a single record does not tell how the cell answers to temperature"
    )
    return (f"{apart}: activation energies and entropy are not fitted.",)


def _span_k(cell: Cell, records: Sequence[Measurement], spectra: Sequence[Spectrum]) -> float:
    """K between the coldest and the warmest record's mean, or spectrum."""
    means = [kelvin_taken(cell, r) for r in records] + [degc_of(s) + ZERO_CELSIUS_K for s in spectra]
    return max(means) - min(means)
