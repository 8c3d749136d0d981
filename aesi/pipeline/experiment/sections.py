"""The sections of an experiment file: what each may say, and what of it cannot be.

The docstring of a section describes each of its keys, `key : unit, meaning`; the table of keys in the documentation is
made of these and of the fields.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_validator,
)

from aesi.data.reading import Reading, column_name
from aesi.physics import ModelName
from aesi.physics.cell import Soh, checked_soh
from aesi.records import Hold

Share = Annotated[float, Field(gt=0, lt=1)]
Positive = Annotated[float, Field(gt=0)]
Weight = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=1)]
SHORT_FOR = {"cell": "bpx"}
"""Section that may be a text alone, in a file or below `fallback` -> the key that the text is the value of."""


class Section(BaseModel):
    """Base of all sections: frozen, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="wrap")
    @classmethod
    def _true_is_no_number(cls, value: Any, validated: ValidatorFunctionWrapHandler) -> Any:
        """Refuse true and false, which are 1 and 0 to Python, where numbers are asked for."""
        taken = validated(value)
        if (said := _taken_for_a_number(value, taken)) is not None:
            raise ValueError(f"{str(said).lower()} is no number; give one")
        return taken


def _taken_for_a_number(given: object, taken: object) -> bool | None:
    """The first truth value of what was given that was taken for something else; None without one."""
    if isinstance(given, bool):
        return None if isinstance(taken, bool) else given
    pairs: Iterable[tuple[object, object]] = ()
    if isinstance(given, Mapping) and isinstance(taken, Mapping):
        pairs = ((value, taken.get(key)) for key, value in given.items())
    elif isinstance(given, list | tuple) and isinstance(taken, tuple):
        pairs = zip(given, taken, strict=True)
    found = (_taken_for_a_number(*pair) for pair in pairs)
    return next((said for said in found if said is not None), None)


class RepeatsConfig(Section):
    """One record that repeats a schedule, cut into its repeats (numbered from 1).

    period_s : s, length of a repeat.
    train : repeats that are trained on.  test : repeats that the finished models meet.
    valid_share : the last share of every training repeat, which validates, so that validation spans the state of
    charge; with 0 the search validates on contiguous pieces of the training repeats in turn, each by models that have
    not seen it.
    """

    period_s: Positive
    train: tuple[Count, ...]
    test: tuple[Count, ...]
    valid_share: Annotated[float, Field(ge=0, lt=1)] = 0.0

    @model_validator(mode="after")
    def _apart(self) -> RepeatsConfig:
        for role, numbers in (("train", self.train), ("test", self.test)):
            if not numbers:
                raise ValueError(f"{role} names no repeat; give at least one")
            twice = next((number for number in numbers if numbers.count(number) > 1), None)
            if twice is not None:
                raise ValueError(f"repeat {twice} is in {role} twice; give it once")
        both = sorted(set(self.train) & set(self.test))
        if both:
            raise ValueError(f"repeat {both[0]} is in train and in test; a repeat has one role")
        return self


class VirtualConfig(Section):
    """How a virtual measurement is made, of kind `virtual`: the paper's profiles on a cell that has more than the ESPM.

    model : what PyBaMM simulates, the porous electrode or one particle an electrode.
    effects : what the cell has beyond its declared parameters; None for the laboratory's default mix.
    magnitude : size of these effects; 1 is typical.
    values : parameters of an effect, by its id and their names, in place of the typical ones.
    pulse_c : C, rate of the charge pulse after each training schedule.
    other_load : times the vehicle's current in the validation and test schedules; 2 takes them to 3.1C.
    seed : of the sensor's noise.
    """

    model: Literal["DFN", "SPMe"] = "DFN"
    effects: tuple[str, ...] | None = None
    magnitude: Positive = 1.0
    values: dict[str, dict[str, float]] = {}
    pulse_c: Annotated[float, Field(ge=0)] = 5.0
    other_load: Positive = 2.0
    seed: Annotated[int, Field(ge=0)] = 0


READING_KEYS = ("columns", "units", "sign", "state_words", "duplicates", "from_s", "to_s")
"""Keys of a data section that say how its files are read."""


class DataConfig(Section):
    """Records by role, or one record cut by repeats.

    kind : where records are from: `files`, paths of measurement files; `catalogue`, names of records of a data set;
    `virtual`, the paper's profiles on a simulated cell, which have their roles already.
    set : the data set, of kind `catalogue` (`aesi data list`).
    record : the one file or record that `repeats` cuts, in place of `train`, `valid` and `test`.
    repeats : how `record` is cut into what trains and what tests.
    train : files or records that are trained on.
    valid : those on which the search validates its candidates; without any it takes parts of the training records.
    test : those that the finished models meet once.
    dt_s : s, step to which the records are brought, which is that of the correction and of its bands.
    hold : how the current runs between rows. A discovery takes it where it is given here, unless `discover.hold` says
    otherwise.
    columns : quantity, or `state`, `cycle`, `step`, and the file's name for it; `state` is the column that gives a
    current its sign, None leaves out the temperature, and a number states it.
    units : quantity and unit of the file's column (`mA`, `mV`, `h`, `K`, `h:m:s`, `date` or a pattern).
    sign : which direction of the file's current is positive; None takes that of a known export, else discharge.
    state_words : words of the state column that are not known, and what each means.
    duplicates : which of several rows with one stamp is kept; None takes the first in a known export and refuses
    others.
    from_s : s, rows from this time on, by record (`{drive.csv: 600}`), as `--from-s` takes them.
    to_s : s, rows up to this time, by record, as `--to-s` takes them.
    virtual : the virtual cell, of kind `virtual`.
    """

    kind: Literal["files", "catalogue", "virtual"]
    set: str | None = None
    record: str | None = None
    repeats: RepeatsConfig | None = None
    train: tuple[str, ...] = ()
    valid: tuple[str, ...] = ()
    test: tuple[str, ...] = ()
    dt_s: Positive = 1.0
    hold: Hold = "backward"
    columns: dict[str, Annotated[str | None, BeforeValidator(column_name)]] = {}
    units: dict[str, str] = {}
    sign: Literal["discharge-positive", "charge-positive"] | None = None
    state_words: dict[str, Literal["charge", "discharge", "rest"]] = {}
    duplicates: Literal["refuse", "first", "last"] | None = None
    from_s: dict[str, float] = {}
    to_s: dict[str, float] = {}
    virtual: VirtualConfig = VirtualConfig()

    @model_validator(mode="after")
    def _complete(self) -> DataConfig:
        if self.kind == "catalogue" and not self.set:
            raise ValueError("kind: catalogue needs `set`, the name of a data set (`aesi data list`)")
        if self.kind == "virtual":
            if self.repeats or self.record or self.train or self.valid or self.test:
                raise ValueError("kind: virtual brings its own records; leave out record, repeats and roles")
            if unread := [name for name in READING_KEYS if getattr(self, name)]:
                raise ValueError(f"`{unread[0]}` is about files, and kind: virtual reads none; leave it out")
            return self
        for name in sorted(set(self.from_s) & set(self.to_s)):
            if not self.from_s[name] < self.to_s[name]:
                raise ValueError(
                    f"{name}: from_s, {self.from_s[name]:g} s, has to be before to_s, {self.to_s[name]:g} s"
                )
        if self.virtual != VirtualConfig():
            raise ValueError(f"`virtual` is of kind: virtual, and this is kind: {self.kind}; leave it out")
        if self.kind == "files" and self.set:
            raise ValueError("`set` is of kind: catalogue, and this is kind: files; leave one of them out")
        return self

    @model_validator(mode="after")
    def _each_in_one_role(self) -> DataConfig:
        if self.repeats and not self.record:
            raise ValueError("`repeats` needs `record`, the record to cut")
        if self.record and (self.train or self.valid or self.test):
            raise ValueError(
                "`record` is cut by `repeats`, which say what trains and tests; give it, or train, valid and test"
            )
        both = next((name for name in self.valid if name in self.train), None)
        if both is not None:
            raise ValueError(f"{both} is in train and in valid; what is fitted cannot validate")
        return self

    def reading(self, name: str) -> Reading:
        """How the file of a record is read."""
        return Reading(
            self.columns,
            self.units,
            self.sign,
            self.state_words,
            start_s=self.from_s.get(name),
            stop_s=self.to_s.get(name),
            duplicates=self.duplicates,
        )

    @property
    def listed(self) -> tuple[str, ...]:
        """The records that it names, of whatever role."""
        return (self.record,) if self.record else (*self.train, *self.valid, *self.test)

    @property
    def declared_hold(self) -> Hold | None:
        """How the current runs between rows where that is said; None where the default stands."""
        return self.hold if "hold" in self.model_fields_set else None

    @property
    def has_roles(self) -> bool:
        """Whether there is something to train on and something to test on."""
        return self.kind == "virtual" or self.repeats is not None or bool(self.train and self.test)


class CellConfig(Section):
    """The cell: what it is declared to be, and the physics that a correction starts from.

    bpx : a BPX file, the folder of a saved model (its cell and effects), or `catalogue` for the cell that belongs to
    the data set; `cell: PATH` alone is short for it.
    soc0 : state of charge at the first row, of several records that of all whose voltage does not contradict it; None
    finds it from the voltage.
    soh : share of the file's capacity that the cell had when it was measured, or that day; None takes all of it.
    model : `espm`, one particle an electrode, or `dfn`, the porous electrode; None takes that of a saved model, or
    that the file was fitted with, else `espm`.
    effects : effects added to the declared cell, by id, each with its parameters.
    effect_files : Python files that hold effects of the user's own; they are run, so name only files that you trust.
    start : the physics that the correction is learned on: the cell as declared, or recalibrated on the training
    records. The tables show both.
    """

    bpx: str = "catalogue"
    soc0: Annotated[float, Field(ge=0, le=1)] | None = None
    soh: Annotated[Soh, AfterValidator(checked_soh)] | None = None
    model: ModelName | None = None
    effects: dict[str, dict[str, float]] = {}
    effect_files: tuple[str, ...] = ()
    start: Literal["declared", "recalibrated"] = "recalibrated"

    @model_validator(mode="before")
    @classmethod
    def _path_alone(cls, value: object) -> object:
        """`cell: found/model` is short for `cell: {bpx: found/model}`."""
        return {SHORT_FOR["cell"]: value} if isinstance(value, str) else value


class LibraryConfig(Section):
    """The candidate terms that the search may choose from.

    p_c : range of the highest order of a polynomial of one variable; its upper end makes the library.
    d : range of the total degree of a product; its upper end makes the library.
    factors : most variables in a product.
    special : whether there are trigonometric and hyperbolic functions.
    mixed : whether there are their products with first-order terms.
    inputs : variables of the terms, `I` among them; None takes the paper's (`I`, `c_sp`, `c_sn`, `c_e0`,
    `c_eL`). Beside these there are `soc`, `I_next`, the current that flows while the predicted error arises, and such
    as `I_60s`, the current through a low-pass of so many seconds.
    feedback : whether terms may hold the error itself, which then feeds back in free run.
    fade : whether a correction without such terms gives way to the physics where left-out drives do not bear it out.

    The defaults are for measured cells, all alike; they were chosen over the development splits of `aesi bench splits`.
    `experiments/virtual_30ah.yaml` has the paper's library.
    """

    p_c: tuple[Annotated[int, Field(ge=0, le=5)], Annotated[int, Field(ge=0, le=5)]] = (1, 2)
    d: tuple[Annotated[int, Field(ge=1, le=5)], Annotated[int, Field(ge=1, le=5)]] = (1, 3)
    factors: Annotated[int, Field(ge=1, le=3)] = 3
    special: bool = False
    mixed: bool = False
    inputs: tuple[str, ...] | None = ("I", "I_next", "I_60s", "c_sp", "c_sn", "c_e0", "c_eL")
    feedback: bool = False
    fade: bool = True

    @field_validator("p_c", "d")
    @classmethod
    def _ordered(cls, value: tuple[int, int]) -> tuple[int, int]:
        if value[0] > value[1]:
            raise ValueError(f"the range [{value[0]}, {value[1]}] is empty; give low <= high")
        return value

    @field_validator("inputs")
    @classmethod
    def _with_the_current(cls, value: tuple[str, ...] | None) -> tuple[str, ...] | None:
        if value is not None and "I" not in value:
            raise ValueError("`I`, the current, has to be among the inputs")
        return value


class SearchConfig(Section):
    """The evolutionary search, in the paper's symbols.

    candidates : how many are evaluated.
    population : candidates in a generation.
    resamples : bootstrap resamples, which every candidate is fitted to.
    block : rows, of a bootstrap block; None takes 500, or a tenth of the training rows where these are few.
    horizon : rows, of a free run inside the losses; None takes a block.
    fold : rows, of the pieces that validate in turn where no records are set aside for it; None takes whole training
    records, halves of training repeats, or an eighth of a single record.
    regime : what the losses measure, errors in free run or one step ahead.
    top_share : share of the resamples, the best of which make an ensemble, and of the candidates, the fittest of which
    are averaged where corrections are not shrunk (`library.fade`).
    lambda1 : range of the ridge.
    lambda2 : range of the threshold below which a coefficient is dropped, in scaled units.
    tau : range of the share of an ensemble that has to keep a term (AESI II).
    pearson_train : least correlation of a candidate with the error on training rows, epsilon of the paper; -1 asks for
    none (a correction that left-out drives do not bear out fades by itself).
    pearson_valid : the same on the validation records.
    weights : gamma of the losses (out-of-bag, validation, sparsity) in the scalar fitness.
    warm_start : whether it begins with a few plain candidates (strong ridge on the whole library).
    timeout_s : s, what one candidate may take before it counts as failed.
    memory_mb : MB, what one candidate may take before it counts as failed; on Linux, and under Dask for each thread
    of a worker, whose threads share what they may take together.
    workers : processes that evaluate candidates.
    """

    candidates: Count = 40
    population: Annotated[int, Field(ge=2)] = 20
    resamples: Annotated[int, Field(ge=2)] = 100
    block: Count | None = None
    horizon: Count | None = None
    fold: Annotated[int, Field(ge=10)] | None = None
    regime: Literal["free_run", "one_step"] = "free_run"
    top_share: Annotated[float, Field(gt=0, le=1)] = 0.1
    lambda1: tuple[Positive, Positive] = (0.1, 1e4)
    lambda2: tuple[Positive, Positive] = (1e-4, 0.1)
    tau: tuple[Share, Share] = (0.3, 0.7)
    pearson_train: Annotated[float, Field(ge=-1, le=1)] = -1.0
    pearson_valid: Annotated[float, Field(ge=-1, le=1)] = -1.0
    weights: tuple[Weight, Weight, Weight] = (0.5, 0.5, 0.0)
    warm_start: bool = True
    timeout_s: Positive = 300.0
    memory_mb: Positive = 6000.0
    workers: Count = 1

    @field_validator("weights")
    @classmethod
    def _weigh_something(cls, value: tuple[float, float, float]) -> tuple[float, float, float]:
        if not any(value):
            raise ValueError("of the losses at least one has to count; all candidates would be as fit")
        return value

    @field_validator("lambda1", "lambda2", "tau")
    @classmethod
    def _ordered(cls, value: tuple[float, float]) -> tuple[float, float]:
        if not value[0] < value[1]:
            raise ValueError(f"the range [{value[0]:g}, {value[1]:g}] is empty; give low < high")
        return value


class ConformalConfig(Section):
    """Prediction intervals one step ahead, and bands of the free run.

    method : how intervals one step ahead are made.
    alpha : share of misses that is aimed at; 0.1 for intervals of 90 %.
    window : rows, the residuals that an interval looks back at.
    horizons_s : s, times since the last measured voltage for which bands are calibrated, beside the whole record, in
    whole steps of `data.dt_s`; None takes those of 1, 10 and 60 s that are. One that the records are too short for has
    no band, which is noted.
    compare : methods that the tables show beside it, calibrated on the same residuals; `spci_refitted`, the paper's
    forest refitted as it goes, can stand here alone.
    """

    method: str = "spci_boosted"
    alpha: Share = 0.1
    window: Annotated[int, Field(ge=2)] = 200
    horizons_s: tuple[Positive, ...] | None = None
    compare: tuple[str, ...] = ("split", "enbpi", "spci_refitted", "spci_linear")

    @field_validator("method")
    @classmethod
    def _known(cls, value: str) -> str:
        from aesi.conformal import METHODS

        if value not in METHODS:
            raise ValueError(f"there is no method {value!r}; there are: {', '.join(METHODS)}")
        return value

    @field_validator("compare")
    @classmethod
    def _all_known(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        from aesi.conformal import COMPARED

        unknown = [name for name in value if name not in COMPARED]
        if unknown:
            raise ValueError(f"there is no method {unknown[0]!r}; there are: {', '.join(COMPARED)}")
        return value

    @model_validator(mode="after")
    def _possible(self) -> ConformalConfig:
        from aesi.conformal import COMPARED

        for name in (self.method, *self.compare):
            COMPARED[name].check(self.alpha, self.window)
        return self


class TrackingConfig(Section):
    """Where runs are tracked.

    uri : of an MLflow store; None takes the SQLite store of the workspace.
    log_model : whether the chosen model is logged so that MLflow can serve it.
    register_model : whether it is registered under the experiment's name.
    system_metrics : whether the load of processor and memory is logged while a run goes on.
    """

    uri: str | None = None
    log_model: bool = True
    register_model: bool = True
    system_metrics: bool = True


class RunnerConfig(Section):
    """Who evaluates candidates.

    kind : worker processes on this machine, or workers of Dask.
    address : of Dask's scheduler; None starts a cluster on this machine.
    storage : a database URL where several `aesi worker` processes share the candidates of one study.
    stage_timeout_s : s, wall time after which a stage of the run (the search, the report) has failed; None for no
    limit.
    """

    kind: Literal["local", "dask"] = "local"
    address: str | None = None
    storage: str | None = None
    stage_timeout_s: Positive | None = None

    @model_validator(mode="after")
    def _address_is_gone_to(self) -> RunnerConfig:
        if self.address is not None and self.kind == "local":
            raise ValueError("`address` names a Dask scheduler; give `kind: dask` beside it, or leave it out")
        return self


class DiscoverConfig(Section):
    """What `aesi discover` needs beyond cell and data.

    fit : records in which it is sought what the cell lacks; kind `virtual` has them by role.
    test : records that choose nothing; one in both goes on where the fit ends.
    good : records of the cell that are known to be good; what is sought is what those in `fit` have beside them.
    fit_until_s : s, by record the time up to which fits see it.
    until_s : s, what comes later is left out of every test record.
    holdout : the last share of each record, kept back where there are no test records; None takes 0.3.
    hold : how the current runs between rows (of `data.kind: virtual` it is known); None takes `data.hold` where that is
    given, else that of each record as its rows show, like `aesi discover` of a file.
    max_effects : most effects that are named.
    """

    fit: tuple[str, ...] = ()
    test: tuple[str, ...] = ()
    good: tuple[str, ...] = ()
    fit_until_s: dict[str, Positive] = {}
    until_s: Positive | None = None
    holdout: Annotated[float, Field(ge=0, le=0.9)] | None = None
    hold: Hold | None = None
    max_effects: Annotated[int, Field(ge=0, le=10)] = 3

    @property
    def listed(self) -> tuple[str, ...]:
        """The records that it names, of whatever role."""
        return *self.fit, *self.test, *self.good

    @model_validator(mode="after")
    def _cuts_what_is_there(self) -> DiscoverConfig:
        unknown = [name for name in self.fit_until_s if name not in self.fit]
        if unknown:
            raise ValueError(
                f"fit_until_s cuts {unknown[0]}, which is not in fit: {', '.join(self.fit) or 'none'}"
            )
        return self


class FallbackConfig(Section):
    """What to run instead where the measured data cannot be had.

    data : records in their place, as in the section `data`.
    cell : their cell, as in the section `cell`.
    """

    data: DataConfig
    cell: CellConfig
