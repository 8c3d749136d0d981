"""The result of a calibration: intervals, undetermined combinations of parameters, parameters on bounds, errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from aesi.calibration.model import Model
from aesi.calibration.parameters import FitParameter
from aesi.constants import MV_PER_V
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.over_time import stamp
from aesi.physics.cell import Cell

if TYPE_CHECKING:
    import pandas as pd
    from plotly.graph_objects import Figure

NINETY_FIVE = 1.96
"""Half width of a 95 % interval, in standard deviations."""
ROUND_OFF = 1e-9
"""Share of a parameter's interval: a value closer to zero is set to zero. A convention."""
BOUND_SHARE = 0.02
"""A parameter closer to a bound than this share of its range is reported to have ended there."""
NOTABLY = 1.05
"""Ratio of a file's error to the start file's above which it counts as larger. A fit to a record of the start file
itself, with 1 mV of noise, ends at 1.02: it begins with films and double layers, and the priors hold it there."""
NAMED_APART = 5
"""Parameters that a sentence on several ends of a fit names at most."""
FAR_SD = 3.0
"""Distance from a prior of the literature, in standard deviations, beyond which no cell is expected: a fit that ends
there indicates a fault of the model. A convention. The double layers of the calibrated files of the repository ended
within 2.9; discharges of an LFP cell at three rates drive its negative one 3.5 from the prior."""


@dataclass(frozen=True)
class Interval:
    """A parameter with its 95 % interval, its unit and the source of its prior."""

    value: float
    low: float
    high: float
    unit: str
    source: str


def ends_sentences(
    costs: Sequence[float], ends: Sequence[Mapping[str, Interval]], of_file: int, failed: int = 0
) -> tuple[str, ...]:
    """Sentences on how far apart the fits from several starts end, and on those that failed; empty for a single start.

    costs : of each end, nats, the end that is taken first.  ends : the parameters there, with the intervals of that
    end.  of_file : index of the end that was reached from the start file.  failed : number of drawn starts from which
    there is no end, since they cannot be simulated.
    """
    lost: tuple[str, ...] = ()
    if failed:
        lost = (
            f"{failed} of {failed + len(costs) - 1} drawn start{'s' if failed + len(costs) > 2 else ''} cannot be "
            "simulated on these records and gave no end.",
        )
    if len(costs) == 1:
        return lost
    taken, *others = ends
    apart = [
        name
        for name, interval in taken.items()
        if any(not interval.low <= other[name].value <= interval.high for other in others)
    ]
    lower = ", ".join(
        f"{cost - costs[0]:.1f}{' (from the start file)' if i == of_file else ''}"
        for i, cost in enumerate(costs[1:], 1)
    )
    origin = "from the start file" if of_file == 0 else "from a drawn start"
    named = ", ".join(apart[:NAMED_APART]) + (" and others" if len(apart) > NAMED_APART else "")
    return (
        f"the fit was repeated from {len(others)} drawn start{'s' if len(others) > 1 else ''}: the best end, "
        f"{origin}, is taken; the others are {lower} nats less likely. "
        + (
            f"There {len(apart)} of {len(taken)} parameters lie outside their 95 % intervals ({named}), which hold for "
            "the end that is taken alone."
            if apart
            else "All parameters there lie within their 95 % intervals."
        ),
        *lost,
    )


@dataclass(frozen=True)
class RecordError:
    """RMSE of one record's rows, V.

    temperature_degc : mean of the record, degC; None where it has no temperature.
    before_v : with the start file.  after_v : with the fit, including the record's own parameters.  simulated_v : with
    the written file, without these parameters, on the currents as measured, from the start that this file reads.
    ran_out_s : s, when the written file runs out of lithium or salt there, and until_v : with it, of the rows before;
    None where it does not.
    """

    name: str
    temperature_degc: float | None
    before_v: float
    after_v: float
    simulated_v: float
    ran_out_s: float | None = None
    until_v: float | None = None

    @property
    def until_mv(self) -> float | None:
        """`until_v` in mV."""
        return None if self.until_v is None else MV_PER_V * self.until_v


def until_words(ran_out_s: float | None, until_mv: float | None) -> str:
    """' (3.20 mV until it runs out at 740 s)' of a simulation that runs out of lithium or salt; '' of others.

    ran_out_s : s.  until_mv : mV, RMSE before; None where it runs out at once.
    """
    if ran_out_s is None:
        return ""
    before = "" if until_mv is None else f"{until_mv:.2f} mV until "
    return f" ({before}it runs out at {stamp(ran_out_s)} s)"


@dataclass(frozen=True)
class Undetermined:
    """A combination of parameters that the data do not determine.

    weights : (parameter, weight) in units of prior standard deviations.  narrowed : posterior over prior standard
    deviation along it, 0 to 1 (1: the data determine nothing).
    """

    weights: tuple[tuple[str, float], ...]
    narrowed: float

    @property
    def sentence(self) -> str:
        """The combination as a sentence."""
        names = ", ".join(f"{name} ({weight:+.2f})" for name, weight in self.weights)
        together = " the combination of" if len(self.weights) > 1 else ""
        return f"the data do not determine{together} {names}: {100 * self.narrowed:.0f} % of the prior's width is left"


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated cell, with its uncertainty.

    cell : calibrated.  declared : start.  parameters : name -> value with its interval.  undetermined : combinations
    that the data do not determine.  at_bounds : names of parameters that ended on a bound.  errors : of each record.
    capacities : record -> its capacity over that of the cell.  starts : record -> state of charge at its first row, in
    the windows of `cell` as old as in that record, as fitted.
    size_assumed : a sentence where no record determined the size of the cell, else ''.  notes : sentences on how the
    fit was set up and where it ended.  seconds : that it took.
    model, x, covariance : the fitted model, its working vector and the covariance of that, for the posterior.
    against_temperature : a sentence for each record whose voltage contradicts the temperature that it was fitted at.
    """

    cell: Cell
    declared: Cell
    parameters: Mapping[str, Interval]
    undetermined: tuple[Undetermined, ...]
    at_bounds: tuple[str, ...]
    errors: tuple[RecordError, ...]
    capacities: Mapping[str, float]
    size_assumed: str
    notes: tuple[str, ...]
    seconds: float
    model: Model
    x: Array
    covariance: Array
    against_temperature: tuple[str, ...] = ()
    starts: Mapping[str, float] = field(default_factory=dict)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons why the fitted parameters may be wrong, a sentence each: a temperature or a given state of charge
        that the voltage contradicts; records on which the fit, or the written file, errs more than the start file,
        which is rare with records of one cell; and parameters that stand in for something that the model lacks."""
        against = (r.start for r in self.model.records if r.start.against_voltage)
        return (
            *self.against_temperature,
            *(
                f"{start.sentence[:-1]}: the fit distorts the cell's parameters to compensate; leave out "
                "--soc0, or correct it, unless the charge was counted and the start file is another cell's."
                for start in against
            ),
            *(
                f"{e.name}: the fit errs by {MV_PER_V * e.after_v:.2f} mV there, the start file by "
                f"{MV_PER_V * e.before_v:.2f} mV; is it a record of the same cell, at the same age and at the "
                "temperature that it was taken at?"
                for e in self.errors
                if e.after_v > NOTABLY * e.before_v
            ),
            *(
                f"{e.name}: the RMSE is {MV_PER_V * e.simulated_v:.2f} mV with the written "
                f"file{until_words(e.ran_out_s, e.until_mv)} and "
                f"{MV_PER_V * e.before_v:.2f} mV with the start file: the capacity, initial state and offset of the "
                "current sensor that were fitted to this record alone are not in the file."
                for e in self.errors
                if e.after_v <= NOTABLY * e.before_v < e.simulated_v
            ),
            *_far_parameter_sentences(self.model, self.x),
        )

    def __repr__(self) -> str:
        errors = ", ".join(
            f"{e.name} {MV_PER_V * e.before_v:.1f} -> {MV_PER_V * e.after_v:.1f} mV" for e in self.errors
        )
        return f"Calibration(cell {self.cell.name!r}, {errors})"

    def to_frame(self) -> pd.DataFrame:
        """The parameters with their 95 % intervals, units and the sources of their priors."""
        import pandas as pd

        rows = {name: asdict(interval) for name, interval in self.parameters.items()}
        return pd.DataFrame.from_dict(rows, orient="index")

    def plot(self) -> Figure:
        """The error of each record as declared and as calibrated, RMSE in mV: a plotly figure."""
        from plotly.graph_objects import Bar, Figure

        names = [error.name for error in self.errors]
        states = {
            "declared": [MV_PER_V * error.before_v for error in self.errors],
            "calibrated": [MV_PER_V * error.after_v for error in self.errors],
        }
        bars = [Bar(name=state, x=names, y=left) for state, left in states.items()]
        return Figure(bars, {"barmode": "group", "yaxis": {"title": {"text": "error, mV RMSE"}}})


def _far_parameter_sentences(model: Model, x: Array) -> tuple[str, ...]:
    """A sentence on the parameters that ended more than `FAR_SD` from a prior of the literature; empty without any."""
    far = [
        f"{free.name} = {free.value(float(z)):.3g} {free.unit} ({abs(z):.1f} standard deviations "
        f"{'above' if z > 0.0 else 'below'} {free.start:.3g})"
        for free, z in zip(model.free, x, strict=False)
        if not free.given and abs(z) > FAR_SD
    ]
    if not far:
        return ()
    stands = "this value probably compensates" if len(far) == 1 else "these values probably compensate"
    return (
        f"{', '.join(far)}: the records contradict what is known of such cells, and {stands} for something that the "
        "model lacks; search for missing effects with aesi discover, or state what you know with --prior.",
    )


def information_weights(model: Model, x: Array) -> Array:
    """(rows + 2 frequencies + n,) factors on `Model.residual`, at most 1, that give it the weight of its independent
    samples.

    The residual of a record after the fit is autocorrelated: n rows of first autocorrelation rho have the information
    of n (1 - rho)/(1 + rho) independent ones. A record never gets more weight than in the fit, however small its
    residual: the priors pulled the parameters against that weight, and intervals from a larger one lie about another
    optimum. Of twelve drives of virtual cells with 1 mV of noise, which the fit counts 15 times less than that, 95 %
    intervals of the full weight missed the true diffusivity of the electrolyte eight times, those of the fit's none.
    """
    out, cell = [], model.cell_at(x)
    for record, error, weight in zip(model.records, model.errors_of(cell, x), model.weights, strict=True):
        seen = error[record.trusted]
        scale = max(rms(seen), 1e-6)
        centred = seen - seen.mean()
        correlation = float(np.dot(centred[1:], centred[:-1]) / max(float(np.dot(centred, centred)), 1e-30))
        rho = min(max(correlation, 0.0), 0.999)
        share = (1.0 - rho) / (1.0 + rho)
        own = np.sqrt(share) / scale / np.where(weight > 0.0, weight, 1.0)
        out.append(np.minimum(own, 1.0))
    return np.concatenate([*out, model.spectra.information_weights(cell), np.ones(model.layout.size)])


def intervals(model: Model, x: Array, covariance: Array) -> dict[str, Interval]:
    """Name -> value and 95 % interval of every global parameter.  x : (n,) working vector.  covariance : (n, n)."""
    out = {}
    for j, free in enumerate(model.free):
        reach = NINETY_FIVE * float(np.sqrt(covariance[j, j]))
        value, low, high = (free.value(float(x[j]) + away) for away in (0.0, -reach, reach))
        if abs(value) < ROUND_OFF * (high - low):  # on a bound of zero
            value = 0.0
        out[free.name] = Interval(value, low, high, free.unit, free.source)
    return out


def undetermined(model: Model, jacobian: Array) -> tuple[Undetermined, ...]:
    """Combinations of global parameters about which the records have less information than the priors.

    They are eigenvectors of the records' information matrix for the global parameters, with all others marginalised, in
    units of the priors. An eigenvalue below one is less than the information of the prior.

    jacobian : (rows + 2 frequencies + n, n) slopes of `Model.residual`, times `information_weights`.
    """
    n = len(model.free)
    information = jacobian.T @ jacobian
    here, rest = information[:n, :n], information[n:, n:]
    marginal = here - information[:n, n:] @ np.linalg.solve(rest, information[n:, :n])
    values, vectors = np.linalg.eigh(marginal - np.eye(n))
    out = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value >= 1.0:
            break
        vector = vector * np.sign(vector[np.argmax(np.abs(vector))])
        order = np.argsort(-np.abs(vector))
        heavy = [j for j in order if abs(vector[j]) > 0.3] or [
            order[0]
        ]  # with many parameters all may be small
        weights = tuple((model.free[j].name, float(vector[j])) for j in heavy)
        out.append(Undetermined(weights, float(1.0 / np.sqrt(1.0 + max(value, 0.0)))))
    return tuple(out)


def at_bounds(model: Model, x: Array) -> tuple[str, ...]:
    """Names of the parameters that ended within BOUND_SHARE of their range of one of its bounds; a lower bound of zero,
    as of a resistance, does not count."""
    width = BOUND_SHARE * (model.high - model.low)
    return tuple(
        f.name
        for j, f in enumerate(model.free)
        if model.high[j] - x[j] < width[j]
        or (x[j] - model.low[j] < width[j] and not _is_zero(f, model.low[j]))
    )


def _is_zero(free: FitParameter, z: float) -> bool:
    return abs(free.value(z)) < ROUND_OFF * free.sd
