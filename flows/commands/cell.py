"""Commands about one cell: simulate, predict, calibrate, impedance, discover, export."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from aesi.advice import KEYS
from aesi.constants import LARGEST_SEED, MILLI
from aesi.errors import InputError
from aesi.pipeline.written import calibration_files, discovery_files, discovery_marks
from flows.commands import options, outputs, record_options

BESIDE_AN_EXPERIMENT = ("experiment", "out", "overrides", "prefect")
"""Arguments of `aesi discover` that may be given with an experiment file."""
KEYS_OF_DISCOVERY = {
    "cell": "cell.bpx",
    "data": "discover.fit",
    "test": "discover.test",
    "good": "discover.good",
    "holdout": "discover.holdout",
    "max_effects": "discover.max_effects",
    "seed": "seed",
    "effect_file": "cell.effect_files",
    "hold": "discover.hold",
    "model": "cell.model",
    "state": "data.columns",
    **{
        name: KEYS[f"--{name.replace('_', '-')}"]
        for name in ("soc0", "soh", "column", "unit", "sign", "state_word", "from_s", "to_s", "duplicates")
    },
}
"""Argument of `aesi discover` -> the key of an experiment file with the same meaning. Others have no such key."""


@record_options.reads_files
def simulate(
    *,
    reading: Any,
    cell: options.CellOption,
    current: options.CurrentOption,
    out: Annotated[
        Path, typer.Option(help="CSV to write: time, current, voltage and the states of the model.")
    ],
    soc0: options.Soc0 = None,
    soh: options.SohOption = None,
    effect: options.Effects = None,
    effect_file: options.EffectFiles = None,
    hold: options.HoldOption = None,
    model: options.ModelOption = None,
    self_heating: options.SelfHeating = False,
    run_on: Annotated[
        bool,
        typer.Option(
            "--run-on",
            help="Continue after the lithium in a particle's surface or the salt in the electrolyte is depleted, "
            "instead of stopping. The voltage is not physical from then on; a message gives the time.",
        ),
    ] = False,
) -> None:
    """Simulate the voltage of a cell under a current profile with the physics model alone."""
    outputs.check_table(out, [cell, current, *(effect_file or [])])
    from aesi.pipeline.simulation import ProfileRequest, simulate_file
    from aesi.pipeline.simulation_words import voltage_words

    asked = ProfileRequest(soc0, hold, reading, self_heating, options.state_of_health(soh), run_on)
    added = options.added_effects(effect, effect_file)
    run = simulate_file(cell, current, out, asked, added, model, record_options.say_notes)
    from aesi.over_time import extent

    typer.echo(f"{out}: {extent(run.time_s)}, {voltage_words(run)}", err=True)


@record_options.reads_files
def predict(
    *,
    reading: Any,
    model: Annotated[
        Path,
        typer.Option("--model", "--cell", help="Folder of a saved hybrid model, such as runs/NAME/model."),
    ],
    current: options.CurrentOption,
    out: Annotated[
        Path,
        typer.Option(
            help="CSV to write, with voltage_v and the bounds lower_v and upper_v of its prediction interval, V."
        ),
    ],
    measured: Annotated[
        bool,
        typer.Option(
            "--measured",
            help="Predict one step ahead: the measured voltage of the row before is known. Default: free run, which "
            "uses no measured voltage after the first row.",
        ),
    ] = False,
    soc0: options.Soc0 = None,
    soc0_sd: Annotated[
        float | None,
        typer.Option(
            "--soc0-sd",
            callback=options.share("--soc0-sd", options.ITS_DEVIATION),
            help="Standard deviation of --soc0, as a share of the capacity (0.01 is 1 %). It widens the band of a free "
            "run. Default: --soc0 is taken as exact.",
        ),
    ] = None,
    soh: options.SohOption = None,
    hold: options.HoldOption = None,
    self_heating: options.SelfHeating = False,
) -> None:
    """Predict the voltage with a saved hybrid model, with prediction intervals."""
    outputs.check_table(out, [model, current])
    from aesi.pipeline.simulation import ProfileRequest, predict_file

    health = options.state_of_health(soh)
    asked = ProfileRequest(soc0, hold, reading, self_heating, health, soc0_sd=soc0_sd)
    rows = predict_file(model, current, out, asked, measured, record_options.say_notes)
    regime = "one step ahead" if measured else "free run"
    typer.echo(f"{out}: {rows:,} rows, {regime}", err=True)


@record_options.reads_files
def calibrate(
    *,
    reading: Any,
    cell: options.CellOption,
    data: Annotated[list[Path], typer.Option("--data", help="Measurement to fit; may be repeated.")],
    out: Annotated[
        Path, typer.Option(help="BPX file to write (.json). A report (HTML) is written beside it.")
    ],
    cut_offs: Annotated[
        str | None,
        typer.Option(
            help="Cut-off voltages of this cell as LOWER:UPPER, V, such as 2.5:4.2. Default: those of the start file."
        ),
    ] = None,
    body: Annotated[
        str | None,
        typer.Option(
            help="Outer size of this cell, mm: DIAMETERxHEIGHT of a cylinder, such as 18.4x65.0, or AxBxC of a box. It "
            "sets volume and surface. Default: those of the start file."
        ),
    ] = None,
    mass: Annotated[
        float | None,
        typer.Option(
            help="Mass of this cell, g. It sets the density. Default: the density of the start file."
        ),
    ] = None,
    soc0: options.RecordSoc0 = None,
    temperature: Annotated[
        list[str] | None,
        typer.Option(
            "--temperature",
            help="Temperature of a record without a temperature column, as FILE=DEGC in degC, such as drive.csv=25; "
            "may be repeated.",
        ),
    ] = None,
    dates: Annotated[
        list[str] | None,
        typer.Option(
            "--date",
            help="Day on which a record was measured, as FILE=YYYY-MM-DD; may be repeated. Between records of "
            "different days the cell may have aged.",
        ),
    ] = None,
    as_of: Annotated[
        str | None,
        typer.Option(
            help="Day (YYYY-MM-DD) whose state of the cell the written file describes, with --date. Default: the last "
            "day of a record under load."
        ),
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option(
            "--prior",
            help="Prior of a parameter as NAME=VALUE:SD, in its unit in the report, in place of the default prior; may "
            "be repeated. Example: contact.resistance=0.0108:0.0012 (ohm).",
        ),
    ] = None,
    hold: options.RecordHold = None,
    until: Annotated[
        list[str] | None,
        typer.Option(
            "--until",
            help="Use a record only up to a time, as FILE=SECONDS, such as hppc.csv=3600; may be repeated.",
        ),
    ] = None,
    impedance: Annotated[
        list[Path] | None,
        typer.Option(
            "--impedance",
            help="Measured impedance spectra that the result is compared with. They are not fitted. May be repeated.",
        ),
    ] = None,
    fit_impedance: Annotated[
        list[Path] | None,
        typer.Option(
            "--fit-impedance",
            help="Measured impedance spectra of this cell that are fitted together with the measurements; may be "
            "repeated.",
        ),
    ] = None,
    posterior: Annotated[
        int,
        typer.Option(
            "--posterior",
            min=0,
            help="Number of samples that each walker draws from the posterior (needs emcee), to test the intervals; 0 "
            "draws none. Example: 500.",
        ),
    ] = 0,
    starts: Annotated[
        int,
        typer.Option(
            "--starts",
            min=1,
            help="Number of fits: the first begins with the start file, the others with cells drawn from the priors. "
            "The best one is taken.",
        ),
    ] = 1,
    title: Annotated[
        str | None,
        typer.Option(help="Name of the cell in the written file. Default: that of the start file."),
    ] = None,
    seed: Annotated[
        int,
        typer.Option(
            min=0,
            max=LARGEST_SEED,
            help="Random seed of the samples of --posterior and the cells of --starts.",
        ),
    ] = 0,
    model: options.ModelOption = None,
) -> None:
    """Fit the parameters of the physics model to all measurements of a cell together, at any temperatures.

    --cell is the start file: its parameters are the starting point and, with their tolerances, the priors of the fit.
    """
    read = [cell, *data, *(impedance or []), *(fit_impedance or [])]
    outputs.check_json(out, read, calibration_files(out))
    data_of_report, *others = calibration_files(out)[1:]
    outputs.check_own(out, others, [data_of_report])
    record_options.check_once("--data", data)
    temperatures = record_options.numbers_by_record("--temperature", temperature, data)
    days, as_of_day = record_options.dates_by_record(dates, data), options.day("--as-of", as_of)
    ends_s = record_options.numbers_by_record("--until", until, data)
    for_all, own_soc0 = record_options.initial_states(soc0, data)
    compared, fitted = record_options.spectra(impedance), record_options.spectra(fit_impedance)
    priors, cut_offs_v, body_mm = options.priors(prior), options.cut_offs(cut_offs), options.body(body)
    record_options.say_reading(data)
    from aesi.calibration import Conditions
    from aesi.pipeline.calibrate import Request, check_request
    from flows.jobs.calibration import calibrate as flow

    request = Request(
        Conditions(for_all, temperatures, days, as_of_day, model, spectra=fitted, priors=priors),
        impedance=compared,
        cut_offs_v=cut_offs_v,
        posterior=posterior,
        starts=starts,
        seed=seed,
        title=title,
        body_mm=body_mm,
        mass_g=mass,
    )
    check_request(cell, request)
    records = record_options.measurements(data, reading, hold, ends_s, own_soc0)
    flow(cell, records, out, request)


def impedance(
    cell: options.CellOption,
    soc: Annotated[
        float,
        typer.Option(
            callback=options.share("--soc"),
            help="State of charge, 0 (empty) to 1 (full); the cell is at rest.",
        ),
    ],
    frequencies: Annotated[
        str,
        typer.Option(
            help="Frequencies, Hz: LOW:HIGH:N for N of them at equal ratios, such as 0.001:1000:61, or a CSV with a "
            "column frequency_hz."
        ),
    ],
    out: Annotated[Path, typer.Option(help="CSV to write: frequency_hz, z_real_ohm, z_imag_ohm.")],
    temperature_degc: Annotated[float, typer.Option(help="Temperature of the cell, degC.")] = 25.0,
    effect: options.Effects = None,
    effect_file: options.EffectFiles = None,
    model: options.ModelOption = None,
    soh: options.SohOption = None,
) -> None:
    """Compute the impedance of the physics model at rest."""
    outputs.check_table(out, [cell, Path(frequencies), *(effect_file or [])])
    from aesi.over_time import range_words
    from aesi.pipeline.impedance import impedance_file

    z = impedance_file(
        cell,
        soc,
        frequencies,
        out,
        temperature_degc,
        options.added_effects(effect, effect_file),
        model,
        options.state_of_health(soh),
        record_options.say_notes,
    )
    size = MILLI * abs(z)
    across = range_words(f"{size.min():.4g}", f"{size.max():.4g}")
    typer.echo(f"{out}: {len(z):,} frequencies, |Z| {across} mOhm", err=True)


@record_options.reads_files
def discover(
    *,
    context: typer.Context,
    reading: Any,
    experiment: Annotated[
        Path | None,
        typer.Argument(
            help="Experiment file (YAML) that names cell and data, in place of --cell and --data."
        ),
    ] = None,
    cell: options.CellUnlessExperiment = None,
    data: Annotated[
        list[Path] | None,
        typer.Option("--data", help="Measurement to search for missing effects; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write: discovery.json, report.html and model/. Default with an experiment file: "
            "runs/NAME/discovery."
        ),
    ] = None,
    test: Annotated[
        list[Path] | None,
        typer.Option(
            "--test",
            help="Held-out measurement: used for the error before and after only. May be repeated. Default: the last "
            "part of the data (--holdout).",
        ),
    ] = None,
    good: Annotated[
        list[Path] | None,
        typer.Option(
            "--good",
            help="Record of the same cell that is known to have no fault; may be repeated. The answer is then how "
            "--data differs from it.",
        ),
    ] = None,
    soc0: options.RecordSoc0 = None,
    soh: options.SohOption = None,
    holdout: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=0.9,
            help="Share of the data, at their end, that is held out without --test. Default: 0.3.",
        ),
    ] = None,
    max_effects: options.MaxEffects = 3,
    seed: options.Seed = 0,
    effect_file: options.EffectFiles = None,
    hold: options.SoughtHold = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            help="Id of an effect to try, as `aesi effects` lists it; may be repeated. No other effect is tried, and "
            "the parameters of all others stay as declared. Default: all effects.",
        ),
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option("--without", help="Id of an effect that is not tried; may be repeated."),
    ] = None,
    model: Annotated[
        Literal["espm", "dfn"] | None,
        typer.Option(
            "--model",
            help="Physics model: espm (single particle) or dfn (porous electrode). Default: both are searched if they "
            "differ notably on the data, and the one that explains them with fewer or likelier effects is taken.",
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        options.key_value(
            "KEY=VALUE that replaces a key of the experiment file, the value in YAML; may be repeated. Example: "
            "discover.max_effects=1."
        ),
    ] = None,
    prefect: options.PrefectOption = True,
) -> None:
    """Find which effects the physics model of a cell lacks, add them, and report the error before and after.

    Example: aesi discover --cell cell.bpx.json --data drive.csv --out found
    """
    if experiment is not None:
        options.check_unsaid(context, BESIDE_AN_EXPERIMENT, KEYS_OF_DISCOVERY)
        _discover_experiment(experiment, list(overrides or []), out, prefect)
        return
    if out is not None:
        read = [*([cell] if cell else []), *(data or []), *(test or []), *(good or []), *(effect_file or [])]
        outputs.check_folder(out, read, discovery_files(out))
        outputs.check_own(out, discovery_files(out), discovery_marks(out))
    if cell is None or not data or out is None:
        needed = {"--cell": cell, "--data": data, "--out": out}
        lacking = " and ".join(option for option, value in needed.items() if not value)
        raise InputError(f"give {lacking}{'' if any(needed.values()) else ', or an experiment file'}.")
    if overrides:
        raise InputError(
            "--set changes a key of an experiment file, and none is given; use the options instead."
        )
    named = [*data, *(test or []), *(good or [])]
    for_all, own_soc0 = record_options.initial_states(soc0, named)
    record_options.say_reading(named)
    from aesi.pipeline.discovery.cases import case_of_files
    from flows.jobs.start import discover as flow

    case = case_of_files(
        cell,
        data,
        test or [],
        good=good or [],
        reading=reading,
        hold=hold,
        soc0=for_all,
        known_soc0=own_soc0,
        holdout=holdout,
        max_effects=max_effects,
        seed=seed,
        effect_files=effect_file or [],
        only=only or [],
        without=without or [],
        model=model,
        soh=options.state_of_health(soh),
    )
    record_options.say_notes(note for m in case.records for note in m.notes)
    flow(case, out, prefect)


def _discover_experiment(experiment: Path, overrides: list[str], out: Path | None, prefect: bool) -> None:
    """Run the discovery of an experiment file.  Raises InputError if its results would overwrite a file that it
    names."""
    record_options.say_reading([experiment])
    from aesi.pipeline.experiment.sources import named_files
    from flows.jobs.discovery import finding_folder
    from flows.jobs.run_request import RunRequest
    from flows.jobs.start import discover_experiment

    request = RunRequest(str(experiment), tuple(overrides))
    place = out or finding_folder(request.config)
    read = [experiment, *named_files(request.config).values()]
    outputs.check_folder(place, read, discovery_files(place))
    outputs.check_own(place, discovery_files(place), discovery_marks(place))
    discover_experiment(request, out, prefect)


def export(
    cell: options.CellOption,
    to: Annotated[
        Literal["bpx", "pybamm"],
        typer.Option(help="Format: bpx (a BPX file) or pybamm (a Python script that PyBaMM runs)."),
    ],
    out: Annotated[Path, typer.Option(help="File to write: .json for bpx, .py for pybamm.")],
) -> None:
    """Write a cell, with the effects that were found, for other programs. Messages name what their format cannot
    hold."""
    from aesi.pipeline.export import export as write
    from aesi.pipeline.export import files_written

    outputs.check_file(out, [cell], files_written(out, to))
    done = write(cell, out, to)
    for sentence in done.held:
        typer.echo(sentence, err=True)
    for sentence in done.left:
        typer.echo(f"Lost to other tools: {sentence}", err=True)
    for file in done.files:
        typer.echo(str(file))
