"""The sections of an experiment file: their keys, defaults and admissible values.

The docstring of a section describes each of its keys as `key : unit, meaning`. The table of keys in the documentation
is generated from these descriptions and from the fields.
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

from aesi.constants import LARGEST_SEED
from aesi.data.channels.columns import known_quantities
from aesi.data.reading import Reading, column_name
from aesi.data.units import known_units
from aesi.physics import ModelName
from aesi.physics.cell import Soh, checked_soh
from aesi.records import Hold

Share = Annotated[float, Field(gt=0, lt=1)]
StateOfCharge = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[float, Field(gt=0)]
Weight = Annotated[float, Field(ge=0)]
LARGEST_COUNT = 10**9
"""Of rows, candidates and processes: no machine holds as many, and what arrays hold ends not far above."""
Count = Annotated[int, Field(ge=1, le=LARGEST_COUNT)]
RandomSeed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]
SHORT_FOR = {"cell": "bpx"}
"""Section that may be written as a single text, also below `fallback` -> key that the text is the value of."""


class Section(BaseModel):
    """Base of all sections: immutable; unknown keys and values that are not finite are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="wrap")
    @classmethod
    def _true_is_no_number(cls, value: Any, validated: ValidatorFunctionWrapHandler) -> Any:
        """Refuse true and false where a number is required; Python would take them as 1 and 0."""
        taken = validated(value)
        if (said := _taken_for_a_number(value, taken)) is not None:
            raise ValueError(f"{str(said).lower()} is no number; give one")
        return taken


def _taken_for_a_number(given: object, taken: object) -> bool | None:
    """The first true or false in `given` that validation has turned into another type in `taken`; None without one."""
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
    """One record that repeats a schedule, cut into its repeats, which are numbered from 1.

    period_s : s, duration of a repeat.
    train : numbers of the repeats that are trained on.
    test : numbers of the repeats that the finished models are tested on.
    valid_share : share of every training repeat, at its end, that validates, so that validation spans the state of
    charge. With 0 the search validates on contiguous pieces of the training repeats in turn, each predicted by models
    that have not seen it.
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
    """How virtual measurements are made (`data.kind: virtual`): PyBaMM simulates the paper's profiles on a cell with
    effects that the declared cell lacks.

    model : model of the virtual cell, `DFN` (porous electrode) or `SPMe` (single particle).
    effects : ids of the effects that the virtual cell has and the declared cell lacks; None takes the default mix.
    magnitude : factor on the size of these effects; 1 is typical.
    values : parameters of effects, as `{id: {parameter: value}}`, in place of the typical ones.
    pulse_c : C, rate of the charge pulse after each training schedule.
    other_load : factor on the vehicle's current in the validation and test schedules; 2 takes them to 3.1C.
    thermocouple : whether the records have a temperature column; None gives them one where the cell heats itself
    (`self_heating`).
    seed : random seed of the sensor noise.
    """

    model: Literal["DFN", "SPMe"] = "DFN"
    effects: tuple[str, ...] | None = None
    magnitude: Positive = 1.0
    values: dict[str, dict[str, float]] = {}
    pulse_c: Annotated[float, Field(ge=0)] = 5.0
    other_load: Positive = 2.0
    thermocouple: bool | None = None
    seed: RandomSeed = 0

    @model_validator(mode="after")
    def _effects_that_are_there(self) -> VirtualConfig:
        from aesi.data.virtual import DEFAULT_MIX

        effects = DEFAULT_MIX if self.effects is None else self.effects
        twice = next((name for name in effects if effects.count(name) > 1), None)
        if twice is not None:
            raise ValueError(
                f"{twice} is in effects twice; give it once, with `magnitude` or `values` for its size"
            )
        if unread := [name for name in self.values if name not in effects]:
            raise ValueError(
                f"values is about {unread[0]}, which the cell does not have; its effects are: "
                f"{', '.join(effects) or 'none'}"
            )
        return self


READING_KEYS = ("columns", "units", "sign", "state_words", "duplicates", "from_s", "to_s")
"""Keys of the section `data` that say how files are read."""


class DataConfig(Section):
    """The records by role, or one record that is cut into repeats.

    kind : source of the records: `files` (paths of measurement files), `catalogue` (names of records of a data set), or
    `virtual` (the paper's profiles on a simulated cell, whose roles are fixed).
    set : name of the data set, with kind `catalogue` (`aesi data list`).
    record : the one file or record that `repeats` cuts, in place of `train`, `valid` and `test`.
    repeats : how `record` is cut into repeats that train and test.
    train : files or records that are trained on.
    valid : files or records on which the search validates its candidates; without any, parts of the training records.
    test : files or records that the finished models are tested on, once.
    dt_s : s, time step to which the records are resampled; also that of the correction and of its bands. With kind
    `virtual` it is that of the records. A discovery takes the rows of files as they are.
    hold : current between rows, `backward` (constant since the row before) or `linear`; with kind `virtual`, whose
    current runs in straight lines, the default is `linear`. A discovery uses it only if it is given here, and
    `discover.hold` takes precedence.
    columns : columns of the files, as `{quantity: name}`, for a quantity, `state`, `cycle` or `step`. `state` is the
    column that gives a current its sign. For the temperature, None leaves it out and a number states it, degC.
    units : units of columns, as `{quantity: unit}` (`mA`, `mV`, `h`, `K`, `h:m:s`, `date` or a strptime pattern).
    sign : direction in which the files' current is positive; None takes that of a known export, else discharge.
    state_words : meaning of unknown words in the state column, as `{word: charge}`, `discharge` or `rest`.
    duplicates : which of several rows with the same time is used; None takes the first in a known export, and refuses
    them in any other file.
    from_s : s, rows from this time on are used, as `{drive.csv: 600}` by record (`--from-s` of the commands).
    to_s : s, rows up to this time are used, by record (`--to-s` of the commands).
    virtual : the virtual measurements, with kind `virtual`.
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
    columns: Annotated[
        dict[str, Annotated[str | None, BeforeValidator(column_name)]], AfterValidator(known_quantities)
    ] = {}
    units: Annotated[dict[str, str], AfterValidator(known_units)] = {}
    sign: Literal["discharge-positive", "charge-positive"] | None = None
    state_words: dict[str, Literal["charge", "discharge", "rest"]] = {}
    duplicates: Literal["refuse", "first", "last"] | None = None
    from_s: dict[str, float] = {}
    to_s: dict[str, float] = {}
    virtual: VirtualConfig = VirtualConfig()

    @model_validator(mode="before")
    @classmethod
    def _virtual_in_straight_lines(cls, value: object) -> object:
        """The default of `hold` for the laboratory's records, which are simulated with a linear current."""
        if isinstance(value, Mapping) and value.get("kind") == "virtual":
            return {"hold": "linear", **value}
        return value

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
        """The options with which the file of a record is read."""
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
        """All records that the section names, in any role."""
        return (self.record,) if self.record else (*self.train, *self.valid, *self.test)

    @property
    def declared_hold(self) -> Hold | None:
        """`hold` if the file gives it; None if it has its default."""
        return self.hold if "hold" in self.model_fields_set else None

    @property
    def has_roles(self) -> bool:
        """Whether the section has training and test records."""
        return self.kind == "virtual" or self.repeats is not None or bool(self.train and self.test)


class CellConfig(Section):
    """The declared cell, and the physics that a correction is learnt on.

    bpx : a BPX file, the folder of a saved model (its cell and effects), or `catalogue` for the cell file of the data
    set. `cell: PATH` is short for `cell: {bpx: PATH}`.
    soc0 : state of charge at the first row, 0 to 1; with several records, of all whose voltage does not contradict it.
    None reads it from the voltage.
    soc0_of : the same of single records of which it is known, as `{record: state of charge}`.
    soh : state of health, as a share of the file's capacity or as the day of the measurement; None takes the file's
    capacity.
    model : `espm` (single particle) or `dfn` (porous electrode); None takes that of a saved model, or the one that the
    file was fitted with, else `espm`.
    effects : effects added to the declared cell, as `{id: {parameter: value}}`.
    effect_files : Python files with the user's own effects. They are run: name only files that you trust.
    start : physics that the correction is learnt on, the cell as declared or recalibrated on the training records. The
    tables show both.
    """

    bpx: str = "catalogue"
    soc0: StateOfCharge | None = None
    soc0_of: dict[str, StateOfCharge] = {}
    soh: Annotated[Soh, AfterValidator(checked_soh)] | None = None
    model: ModelName | None = None
    effects: dict[str, dict[str, float]] = {}
    effect_files: tuple[str, ...] = ()
    start: Literal["declared", "recalibrated"] = "recalibrated"

    @model_validator(mode="before")
    @classmethod
    def _path_alone(cls, value: object) -> object:
        """Accept `cell: found/model`, which is short for `cell: {bpx: found/model}`."""
        return {SHORT_FOR["cell"]: value} if isinstance(value, str) else value


class LibraryConfig(Section):
    """The library: the candidate terms that the search may choose from.

    p_c : range of the highest order of a polynomial in one variable; its upper end limits the library.
    d : range of the total degree of a product; its upper end limits the library.
    factors : largest number of variables in a product.
    special : whether the library has trigonometric and hyperbolic functions.
    mixed : whether it has products of these functions with first-order terms.
    inputs : variables of the terms, `I` (current) among them; None takes those of the paper (`I`, `c_sp`, `c_sn`,
    `c_e0`, `c_eL`). Further ones are `soc`, `I_next` (the current that flows while the predicted error arises), and the
    current through a low-pass filter, such as `I_60s` with a time constant of 60 s.
    feedback : whether terms may contain the error itself, which then feeds back in free run.
    fade : whether a correction without feedback gives way to the physics where left-out drives do not support it.

    The defaults are for all measured cells. They were chosen over the development splits of `aesi bench splits`.
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
    """The evolutionary search for a correction, with the symbols of the paper.

    candidates : number of candidates that are evaluated.
    population : number of candidates in a generation.
    resamples : number of bootstrap resamples that every candidate is fitted to.
    block : rows, length of a bootstrap block; None takes 500, or a tenth of the training rows if these are few.
    horizon : rows, length of a free run in the losses; None takes that of a block.
    fold : rows, length of the pieces that validate in turn if there are no validation records; None takes whole
    training records, halves of training repeats, or an eighth of a single record.
    regime : errors that the losses measure, in free run (`free_run`) or one step ahead (`one_step`).
    top_share : share of the resamples, the best ones, that make an ensemble; also share of the candidates, the fittest
    ones, that are averaged if corrections do not fade (`library.fade`).
    lambda1 : range of the ridge.
    lambda2 : range of the threshold below which a coefficient is dropped, in scaled units.
    tau : range of the share of an ensemble that has to keep a term (AESI II).
    pearson_train : least correlation of a correction with the error on training rows, epsilon in the paper; -1 sets
    no limit (a correction that left-out drives do not support fades by itself).
    pearson_valid : the same on the validation records.
    weights : weights of the losses (out-of-bag, validation, sparsity) in the scalar fitness, gamma in the paper.
    warm_start : whether the search begins with a few simple candidates (strong ridge, whole library).
    timeout_s : s, time after which one candidate counts as failed.
    memory_mb : MB, address space that a candidate may take beyond what its process has before it; one that takes more
    counts as failed. On Linux only. Under Dask it is the limit of each thread of a worker, whose threads share the sum
    of their limits.
    workers : number of processes that evaluate candidates.
    """

    candidates: Count = 40
    population: Annotated[Count, Field(ge=2)] = 20
    resamples: Annotated[Count, Field(ge=2)] = 100
    block: Count | None = None
    horizon: Count | None = None
    fold: Annotated[Count, Field(ge=10)] | None = None
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

    method : method of the intervals one step ahead.
    alpha : nominal share of misses; 0.1 for intervals of 90 %.
    window : rows, number of past residuals that an interval is predicted from.
    horizons_s : s, times since the last measured voltage for which bands are calibrated, in addition to the whole
    record; multiples of `data.dt_s`. None takes those of 1, 10 and 60 s that are such multiples. A horizon that the
    records are too short for has no band, and a note says so.
    compare : methods that the tables show beside it, calibrated on the same residuals. `spci_refitted`, the paper's
    forest that is refitted as it goes on, can be given here but not as `method`.
    """

    method: str = "spci_boosted"
    alpha: Share = 0.1
    window: Annotated[Count, Field(ge=2)] = 200
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

    uri : address of an MLflow store, such as `http://HOST:5000`; None takes the SQLite store of the workspace.
    log_model : whether the chosen model is logged in a form that MLflow can serve.
    register_model : whether the chosen model is registered under the name of the experiment.
    system_metrics : whether the use of processor and memory is logged during a run.
    """

    uri: str | None = None
    log_model: bool = True
    register_model: bool = True
    system_metrics: bool = True


class RunnerConfig(Section):
    """Where candidates are evaluated.

    kind : `local` (processes on this machine) or `dask` (workers of a Dask cluster).
    address : address of the Dask scheduler, such as `tcp://HOST:8786`; None starts a cluster on this machine.
    storage : URL of a database in which several `aesi worker` processes share the candidates of one study.
    stage_timeout_s : s, wall time after which a stage of the run (the search, the report) counts as failed; None sets
    no limit.
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
    """What `aesi discover` needs in addition to cell and data.

    fit : records in which missing effects are searched; kind `virtual` has its own.
    test : held-out records; a record that is in `fit` as well is tested on the part after `fit_until_s`.
    good : known-good records of the cell; the search is then for what differs in the records of `fit`.
    fit_until_s : s, time up to which a record of `fit` is fitted, as `{record: time}`.
    until_s : s, time up to which every record of `test` is used, or every test record of kind `virtual`.
    holdout : share of each record, at its end, that is held out if there are no test records; None takes 0.3.
    hold : current between rows, `backward` or `linear` (known with `data.kind: virtual`). None takes `data.hold` if the
    file gives it, else what explains the data better, and where neither does, `backward` for a record with rows more
    than 5 s apart and `linear` for others.
    max_effects : largest number of effects that are named.
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
        """All records that the section names, in any role."""
        return *self.fit, *self.test, *self.good

    @property
    def ends_nothing(self) -> bool:
        """Whether `until_s` is given and `test` names no record that it ends; virtual records are not named."""
        return self.until_s is not None and not self.test

    @model_validator(mode="after")
    def _cuts_what_is_there(self) -> DiscoverConfig:
        unknown = [name for name in self.fit_until_s if name not in self.fit]
        if unknown:
            raise ValueError(
                f"fit_until_s cuts {unknown[0]}, which is not in fit: {', '.join(self.fit) or 'none'}"
            )
        return self


class FallbackConfig(Section):
    """Data and cell that are used if the measured data are not available.

    data : the records, with the keys of the section `data`.
    cell : their cell, with the keys of the section `cell`.
    """

    data: DataConfig
    cell: CellConfig
