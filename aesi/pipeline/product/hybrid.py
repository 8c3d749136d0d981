"""The hybrid model: physics with added effects, a sparse correction of the remaining error, and prediction bands.

A record is resampled to the step of the correction, predicted there in free run or one step ahead, and interpolated
back to its own rows. The files of a saved model: `aesi.pipeline.product.model_folder`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np

from aesi.advice import advises_python
from aesi.conformal import WHOLE_DRIVE, Calibrated, FreeRunBands, calibrated_from_dict
from aesi.data.resample import is_even, is_sparse, to_even
from aesi.errors import CellError, DataError, InputError, SimulationError, in_words
from aesi.numerics.typing import Array, BoolArray, Numbers
from aesi.numerics.visited import Visited
from aesi.over_time import stamp
from aesi.physics import ActiveEffect, Cell, ModelName, initial_state
from aesi.physics.arguments import check_cell, check_choice, check_measurement, checked_effects, checked_soc
from aesi.physics.cell import Soh
from aesi.physics.depletion import RUN_ON
from aesi.physics.effects import active_effect, saved_effect
from aesi.physics.record_checks import check_voltage
from aesi.pipeline.product.deviations import PhysicsVariant, slopes_v, start_v
from aesi.pipeline.product.error_series import error_series
from aesi.pipeline.product.model_folder import part_file, read_model, write_model
from aesi.pipeline.product.one_step import rows_ahead
from aesi.pipeline.product.prediction import Prediction
from aesi.pipeline.product.trained import outside_trained, trained_on
from aesi.pipeline.written import EFFECTS, HEAD
from aesi.records import ErrorSeries, FreeRun, Hold, Measurement
from aesi.records.checked import checked_dt, is_finite_number, numbers, of_columns, row_words
from aesi.records.steps import after_gap, next_stamp
from aesi.sparse import SparseModel
from aesi.sparse.bare import Bare
from aesi.sparse.terms.inputs import same_step

END_BEFORE = ", or end the record before that (--to-s on the command line)."
"""End of a sentence on a record in which the cell runs out: correction and bands are meaningless from there on."""


@dataclass(frozen=True, eq=False)
class HybridModel:
    """A physics model with effects, a correction of its voltage error and prediction intervals.

    effects : active effects in addition to the cell.  correction : sparse model of the error, or None.
    intervals : intervals one step ahead, or None.  bands : bands of a free run, or None.
    dt_s : step of correction and bands, s; records with other steps are resampled to it and back.
    hold : how the current runs between rows of records that do not declare it; None tells it by their rows.
    soc0 : default state of charge at the first row, or None.
    model : of the physics, "espm" or "dfn".
    held : effects that are contained in values of the cell, in words.  beside : effects, held or active, that were
    fitted together with the found ones and are no finding themselves, in the same words, or by their ids.
    finding : its errors on test records, in words; '' where they are not known.
    soh : share of the capacity of the file that it was made from, which its cell has.
    fitted_to : (name, `Measurement.file_digest`) of the records that it was fitted to, in whole or in part, or chosen
    by; those of the models that it was made from among them.
    """

    cell: Cell
    effects: tuple[ActiveEffect, ...] = ()
    correction: SparseModel | None = None
    intervals: Calibrated | None = None
    bands: FreeRunBands | None = None
    dt_s: float = 1.0
    hold: Hold | None = "linear"
    soc0: float | None = None
    model: ModelName = "espm"
    held: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    finding: str = ""
    soh: float = 1.0
    fitted_to: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        """Raises InputError for a wrong cell, effects, step, hold, state of charge or model, and for a correction that
        steps otherwise."""
        check_cell(self.cell)
        object.__setattr__(self, "effects", checked_effects(self.effects))
        object.__setattr__(self, "dt_s", checked_dt(self.dt_s))
        if self.correction is not None and not same_step(self.correction.dt_s, self.dt_s):
            raise InputError(
                f"dt_s = {self.dt_s:g} s, but the correction steps by {self.correction.dt_s:g} s; give that as dt_s."
            )
        if self.hold is not None:
            check_choice("hold", self.hold, Hold)
        object.__setattr__(self, "soc0", checked_soc(self.soc0))
        check_choice("model", self.model, ModelName)

    def __repr__(self) -> str:
        cell = f"cell {self.cell.name!r}" + (f" changed by {', '.join(self.held)}" if self.held else "")
        parts = [cell, *(repr(effect) for effect in self.effects)]
        parts += [repr(part) for part in (self.correction, self.intervals, self.bands) if part is not None]
        return f"HybridModel({', '.join(parts)})"

    def with_soh(self, soh: Soh | None) -> Self:
        """A copy with the cell at a state of health, see `Cell.with_soh`; unchanged for None."""
        if soh is None:
            return self
        cell = self.cell.with_soh(soh)
        return replace(self, cell=cell, soh=self.soh * cell.capacity_ah / self.cell.capacity_ah)

    def with_fitted(self, records: Iterable[Measurement]) -> Self:
        """A copy that was fitted to these records as well."""
        added = ((record.name, record.file_digest) for record in records)
        return replace(self, fitted_to=tuple(dict.fromkeys((*self.fitted_to, *added))))

    def was_beside(self, words: str) -> bool:
        """Whether an effect, in the words of `held`, was fitted together with the found ones and is no finding."""
        return words in self.beside or id_in(words) in self.beside

    def hold_of(self, record: Measurement) -> Hold:
        """How the current of a record runs between its rows: as it declares, else as the model was made, else as
        `Measurement.hold_taken` says."""
        return record.hold or self.hold or record.hold_taken

    @property
    def visited(self) -> Visited | None:
        """The states of charge and temperatures that the correction was trained on; None where they are not known."""
        return trained_on(self.correction, self.bands)

    @advises_python
    @of_columns
    def predict(
        self,
        time_s: Numbers,
        current_a: Numbers,
        soc0: float | None = None,
        voltage_v: Numbers | None = None,
        temperature_degc: Numbers | None = None,
        error0_v: float | None = None,
        soc0_sd: float = 0.0,
    ) -> Prediction:
        """Voltage under a current, with its band.

        time_s, current_a : (n,) s, A (discharge positive).
        voltage_v : (n,) V, measured, for predictions one step ahead: each sample is predicted from those before it, the
        first by the physics alone and without a band. Rows denser than the model's step are predicted from the mean of
        those in the step before; the band holds for single rows. None for a free run.
        error0_v : initial error of a free run, V, measured minus physics at the first sample, from which the correction
        starts. None takes the error that the inputs give, with the band of a whole drive from the first sample on.
        Ignored one step ahead.
        soc0 : state of charge at the first sample, 0 to 1; None takes it from the first measured voltage at rest, else
        the model's own.  temperature_degc : as in `simulate`.
        soc0_sd : standard deviation of soc0, which widens the band of a free run. 0 takes soc0 as exact; if it is not,
        the band covers almost nothing.

        Raises DataError where the record cannot be simulated, where its first voltage does not belong to this cell,
        where soc0 is unknown, and, one step ahead, for rows further apart than the step of a model that has a
        correction or intervals; InputError as `predict_record`.
        """
        free = voltage_v is None
        measured = np.full(np.shape(time_s), np.nan) if free else numbers(voltage_v, "voltage_v")
        record = Measurement(time_s, current_a, measured, temperature_degc, "the record")
        return self.predict_record(record, soc0, one_step=not free, error0_v=error0_v, soc0_sd=soc0_sd)

    def predict_record(
        self,
        record: Measurement,
        soc0: float | None = None,
        *,
        one_step: bool = False,
        error0_v: float | None = None,
        soc0_sd: float = 0.0,
    ) -> Prediction:
        """`predict` for a record: one step ahead of its voltage, or in free run, which uses only the first voltage.

        error0_v : initial error of a free run, V; None takes it from the first voltage, as in the test of an
        experiment, or as `predict` does where that voltage is missing.
        soc0 : None reads it with its standard deviation from the voltage at the start of the record, also for a free
        run; without a voltage it is the model's own.
        soc0_sd : standard deviation of a soc0 that is not read from the voltage; it widens the band of a free run.
        Raises InputError for what is no Measurement, for a soc0_sd outside 0 to 1, for an error0_v that is not finite,
        and for one in a free run of a model without a correction; else as `predict`.
        """
        check_measurement(record)
        self._check_start(error0_v, soc0_sd, one_step)
        # The rows tell it as they are, not once they are averaged or their voltages hidden.
        record = record.held(self.hold_of(record))
        if one_step:
            _check_every_voltage(record)
        from_first = error0_v is None and np.isfinite(record.voltage_v[:1]).any()
        if one_step or from_first:
            check_voltage(self.cell, record.take(slice(0, 1)))  # from which state and error start
        if soc0 is None:
            soc0, soc0_sd = self._initial_soc(record, soc0_sd)
        if one_step:
            self._check_dense(record)
        else:
            seen = np.arange(len(record)) < (1 if from_first else 0)
            record = replace(record, voltage_v=np.where(seen, record.voltage_v, np.nan))
        even = self._even(record)
        series = self._series(even, soc0)
        own = None if even is record else self._series(record, soc0)
        if one_step:
            return self._one_step(replace(series, own=own))
        prediction = self._free_run(self._with_slopes(series, even, soc0, soc0_sd), error0_v)
        return prediction if own is None else _on_own_rows(prediction, own)

    def save(self, folder: str | Path) -> Path:
        """Write the model to a folder, made where it is missing; returns the folder."""
        folder = Path(folder)
        saved = [saved_effect(effect) for effect in self.effects]
        parts: dict[str, Any] = {
            "cell.bpx": self.cell.to_bpx(),
            EFFECTS: [content for content, _ in saved],
        }
        for name in ("correction", "intervals", "bands"):
            part = getattr(self, name)
            if part is not None:
                parts[name] = part.to_dict()
        own: dict[str, Any] = {
            name: getattr(self, name) for name in ("dt_s", "hold", "soc0", "model", "finding", "soh")
        }
        files = {name: code for _, beside in saved for name, code in beside.items()}
        own |= {"held": list(self.held), "beside": list(self.beside)}
        own |= {"fitted_to": [{"name": name, "digest": digest} for name, digest in self.fitted_to]}
        write_model(folder, own, parts, files)
        return folder

    @staticmethod
    def load(folder: str | PathLike[str]) -> HybridModel:
        """Read a model folder. Raises InputError naming the file that is missing or not as written by `save`, and for
        what is no path."""
        if not isinstance(folder, str | PathLike):
            raise InputError(
                f"an object of type {type(folder).__name__} is no folder; give the path of a saved model."
            )
        folder = Path(folder)
        head, parts = read_model(folder)
        read: dict[str, Any] = {}
        for name, of_content in (
            ("correction", SparseModel.from_dict),
            ("intervals", calibrated_from_dict),
            ("bands", FreeRunBands.from_dict),
        ):
            with _as_saved(part_file(folder, name)):
                read[name] = of_content(parts[name]) if name in parts else None
        with _as_saved(part_file(folder, EFFECTS)):
            saved = parts.get(EFFECTS, [])
            if not isinstance(saved, list):
                raise TypeError("it holds no list of effects")
            read["effects"] = tuple(active_effect(content, folder) for content in saved)
        with _as_saved(folder / HEAD):
            return HybridModel(
                cell=Cell.from_bpx(part_file(folder, "cell.bpx"), fitted=True),
                dt_s=head["dt_s"],
                hold=head["hold"],
                soc0=head["soc0"],
                model=head.get("model", "espm"),
                held=tuple(head.get("held", ())),
                beside=tuple(head.get("beside", ())),
                finding=head.get("finding", ""),
                soh=head.get("soh", 1.0),
                fitted_to=tuple((one["name"], one["digest"]) for one in head.get("fitted_to", ())),
                **read,
            )

    def _initial_soc(self, record: Measurement, soc0_sd: float) -> tuple[float, float]:
        """(state of charge at the first row, its standard deviation), from its voltage; without a voltage the model's
        own, and `soc0_sd`."""
        if np.isfinite(record.voltage_v[:1]).any():
            read = initial_state(
                self.cell, record, None, self.hold_of(record), self.effects, model=self.model
            )
            return read.soc, read.read_sd
        if self.soc0 is None:
            raise DataError("a free run needs soc0, the state of charge at the first sample; give it.")
        return self.soc0, soc0_sd

    def _check_start(self, error0_v: float | None, soc0_sd: float, one_step: bool) -> None:
        """Raises InputError for the start of a prediction that is none, or that this model has no use for."""
        if error0_v is not None and not is_finite_number(error0_v):
            raise InputError(f"error0_v = {in_words(error0_v)} is no voltage; give volts, or leave it out.")
        if error0_v is not None and not one_step and self.correction is None:
            raise InputError(
                f"error0_v = {error0_v:g} V is where a correction starts, and this model has none: physics alone has "
                "no error to start from; leave it out."
            )
        if not (is_finite_number(soc0_sd) and 0.0 <= soc0_sd <= 1.0):
            raise InputError(
                f"soc0_sd = {in_words(soc0_sd)} is no standard deviation of a state of charge; give 0 to 1."
            )

    @property
    def _looks_back(self) -> bool:
        """Whether one step ahead the voltage of the step before is used: by the correction, or by the intervals."""
        return self.correction is not None or self.intervals is not None

    def _check_dense(self, record: Measurement) -> None:
        if self._looks_back and is_sparse(record.time_s, record.current_a, self.dt_s):
            apart_s = float(np.median(np.diff(record.time_s)))
            raise DataError(
                f"{record.name}: its rows are {apart_s:g} s apart, and one step of the model is {self.dt_s:g} s, "
                "so that no voltage is known a step before a row; leave out the measured voltage (--measured) for a "
                "free run, or give a record of denser rows."
            )

    def after_gap(self, time_s: Array) -> BoolArray:
        """(n,) True for a row after a gap: no row lies one step before it, so that it is predicted from further back.

        time_s : (n,) s of the rows.
        """
        if not self._looks_back:
            return np.zeros(len(time_s), dtype=bool)
        return after_gap(time_s, self.dt_s)

    def _even(self, record: Measurement) -> Measurement:
        """The record resampled to the model's step; itself where it has that step, or the physics is alone."""
        stepping = self._looks_back or self.bands is not None
        if not stepping or is_even(record.time_s, self.dt_s):
            return record
        if len(record) > 1 and record.time_s[-1] - record.time_s[0] < self.dt_s:
            raise DataError(
                f"{record.name} lasts {record.time_s[-1] - record.time_s[0]:g} s, and the model steps by "
                f"{self.dt_s:g} s; give a longer one."
            )
        return to_even(record, self.dt_s, self.hold_of(record))

    def _series(self, record: Measurement, soc0: float) -> ErrorSeries:
        try:
            run = self.physics.run(record, soc0, self.hold_of(record), "raise")
        except SimulationError as error:
            if not str(error).endswith(RUN_ON):
                raise
            raise SimulationError(f"{str(error).removesuffix(RUN_ON)}{END_BEFORE}") from None
        return error_series(record, run, self.dt_s)

    def _with_slopes(
        self, series: ErrorSeries, record: Measurement, soc0: float, soc0_sd: float
    ) -> ErrorSeries:
        """The series with the sensitivities of the physics that the band needs: one simulation for each uncertain
        parameter, and one for the initial state."""
        if self.bands is not None and soc0_sd > 0.0:
            series = replace(series, start_v=self.start_worth_v(record, soc0, soc0_sd, series.model_v))
        if self.bands is None or self.bands.root is None:
            return series
        slopes = slopes_v(
            self.cell, self.effects, record, soc0, self.hold_of(record), self.model, series.model_v
        )
        return replace(series, slopes_v=slopes)

    def start_worth_v(self, record: Measurement, soc0: float, soc0_sd: float, physics_v: Array) -> Array:
        """(n,) V, >= 0, change of the record's physics_v (n,) where it starts `soc0_sd` away from soc0; see
        `start_v`."""
        return start_v(self.physics, record, soc0, soc0_sd, self.hold_of(record), physics_v)

    @property
    def physics(self) -> PhysicsVariant:
        """The model without its correction."""
        return PhysicsVariant(self.cell, self.cell, self.effects, model=self.model)

    def _free_run(self, series: ErrorSeries, error0_v: float | None) -> Prediction:
        n = len(series)
        measured = error0_v is not None or np.isfinite(series.error_v[:1]).any()
        run, weight = FreeRun(np.zeros(n), None, np.zeros(n, dtype=bool)), np.full(n, np.nan)
        if self.correction is not None:
            run, weight = self.correction.free_run(series, error0_v), self.correction.kept(series)
            run = replace(run, outside=outside_trained(run.outside, series, self.visited))
        low = high = np.full(n, np.nan)
        if self.bands is not None:
            reach = 0.0 if self.correction is None else self.correction.reach(series, error0_v=error0_v)
            band = self.bands.intervals(series, run, reach, None if measured else WHOLE_DRIVE)
            low, high = band.lower_v, band.upper_v
        alpha = None if self.bands is None else self.bands.alpha
        diverged_s = None if run.diverged_at is None else float(series.time_s[run.diverged_at])
        found = Prediction.of(series, run.error_v, low, high, run.outside, weight, alpha)
        return replace(found, diverged_s=diverged_s)

    def _one_step(self, series: ErrorSeries) -> Prediction:
        """Prediction of the record's own rows. Each counts as the last row of its step, of which no earlier row is
        known."""
        own, known = series if series.own is None else series.own, series.with_known_error
        step = next_stamp(own.time_s, series.time_s)
        error, weight = np.zeros(len(known)), np.full(len(known), np.nan)
        outside = np.zeros(len(known), dtype=bool)
        if self.correction is not None:
            error, weight = self.correction.one_step(known), self.correction.kept(known)
            error[0] = 0.0  # nothing was measured before the first sample
            outside = outside_trained(self.correction.outside(known), known, self.visited)
        low = high = np.full(len(own), np.nan)
        if self.intervals is not None:
            ahead = rows_ahead(self.correction or Bare(), series)
            band = self.intervals.intervals(ahead.residual_v, ahead.current_a)
            at = np.searchsorted(ahead.stamps, step)
            low, high = (np.where(step == 0, np.nan, bound[at]) for bound in (band.lower_v, band.upper_v))
        alpha = None if self.intervals is None else self.intervals.alpha
        found = Prediction.of(own, error[step], low, high, outside[step], weight[step], alpha)
        repeated = np.where(step == 0, np.nan, known.error_v[np.maximum(step - 1, 0)])
        return replace(found, persistence_v=own.model_v + repeated)


def _check_every_voltage(record: Measurement) -> None:
    """Raises DataError for a row without a voltage, from which one step ahead nothing can be predicted."""
    lacking = np.flatnonzero(~np.isfinite(record.voltage_v))
    if len(lacking):
        row = int(lacking[0])
        raise DataError(
            f"voltage_v has no value at {stamp(record.time_s[row])} s ({row_words(row)}); predict the parts before "
            "and after the gap as records of their own, or leave voltage_v out for a free run."
        )


def _on_own_rows(prediction: Prediction, own: ErrorSeries) -> Prediction:
    """A free run on the record's own rows: the physics is simulated there (`own`), correction and band are
    interpolated."""

    def onto(values: Array) -> Array:
        return np.interp(own.time_s, prediction.time_s, values)

    return replace(
        prediction,
        time_s=own.time_s,
        voltage_v=own.model_v + onto(prediction.voltage_v - prediction.physics_v),
        lower_v=own.model_v + onto(prediction.lower_v - prediction.physics_v),
        upper_v=own.model_v + onto(prediction.upper_v - prediction.physics_v),
        physics_v=own.model_v,
        soc=own.soc,
        outside=onto(prediction.outside.astype(float)) > 0,
        weight=onto(prediction.weight),
        temperature_degc=own.temperature_degc,
        collector_mol_m3=own.collector_mol_m3,
    )


def id_in(words: str) -> str:
    """The id of an effect in its words, `series_resistance(resistance_ohm=0.008)`."""
    return words.partition("(")[0]


@contextmanager
def _as_saved(file: Path) -> Iterator[None]:
    """Turns errors in the content of a model's file into an InputError that names the file."""
    try:
        yield
    except CellError:
        raise  # its sentence names the file
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    except KeyError as error:
        raise InputError(f"{file} lacks {error}; save the model again.") from None
    except (TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError(f"{file} is not as it was saved ({error}); save the model again.") from None
