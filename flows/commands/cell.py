"""Commands about one cell: simulate, predict, calibrate, impedance, discover."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from aesi.errors import InputError
from aesi.pipeline.written import calibration_files, discovery_files
from flows.commands import options, outputs

BESIDE_AN_EXPERIMENT = ("experiment", "out", "overrides", "prefect")
"""What `aesi discover` takes beside an experiment file, which says all else itself."""


@options.reads_files
def simulate(
    *,
    reading: Any,
    cell: options.CellOption,
    current: Annotated[Path, typer.Option(help="CSV with time_s, current_a[, temperature_degc].")],
    out: Annotated[Path, typer.Option(help="CSV to write: time, current, voltage and states.")],
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
            help="Continue past depletion of a particle's surface or of the electrolyte. The voltage is not physical "
            "from then on; a message gives the time.",
        ),
    ] = False,
) -> None:
    """The physics model alone, under a current profile."""
    outputs.check_table(out, [cell, current, *(effect_file or [])])
    from aesi.pipeline.simulation import ProfileRequest, simulate_file, voltage_words

    asked = ProfileRequest(soc0, hold, reading, self_heating, options.state_of_health(soh), run_on)
    added = options.added_effects(effect, effect_file)
    run = simulate_file(cell, current, out, asked, added, model, options.say_notes)
    from aesi.over_time import extent

    typer.echo(f"{out}: {extent(run.time_s)}, {voltage_words(run)}", err=True)


@options.reads_files
def predict(
    *,
    reading: Any,
    model: Annotated[
        Path, typer.Option("--model", "--cell", help="Folder of a saved model (runs/.../model).")
    ],
    current: Annotated[Path, typer.Option(help="CSV with time_s, current_a[, voltage_v, temperature_degc].")],
    out: Annotated[Path, typer.Option(help="CSV to write: voltage_v, lower_v, upper_v.")],
    measured: Annotated[
        bool, typer.Option("--measured", help="Use the measured voltage: one step ahead, not free run.")
    ] = False,
    soc0: options.Soc0 = None,
    soc0_sd: Annotated[
        float | None,
        typer.Option(
            "--soc0-sd",
            callback=options.share("--soc0-sd", options.ITS_DEVIATION),
            help="How far --soc0 may be off, one standard deviation, by which the band of a free run is wider.",
        ),
    ] = None,
    soh: options.SohOption = None,
    hold: options.HoldOption = None,
    self_heating: options.SelfHeating = False,
) -> None:
    """A saved hybrid model with its intervals."""
    outputs.check_table(out, [model, current])
    from aesi.pipeline.simulation import ProfileRequest, predict_file

    health = options.state_of_health(soh)
    asked = ProfileRequest(soc0, hold, reading, self_heating, health, soc0_sd=soc0_sd)
    rows = predict_file(model, current, out, asked, measured, options.say_notes)
    regime = "one step ahead" if measured else "free run"
    typer.echo(f"{out}: {rows:,} rows, {regime}", err=True)


@options.reads_files
def calibrate(
    *,
    reading: Any,
    cell: options.CellOption,
    data: Annotated[list[Path], typer.Option("--data", help="Measurement to fit; may be given again.")],
    out: Annotated[Path, typer.Option(help="BPX file to write; a report is written beside it.")],
    cut_offs: Annotated[
        str | None,
        typer.Option(
            help="LOWER:UPPER, V, between which this cell is cycled, where the start file has others."
        ),
    ] = None,
    body: Annotated[
        str | None,
        typer.Option(
            help="DIAMETERxHEIGHT of this cell, or AxBxC of a flat one, mm: its volume and surface, where the start "
            "file is of another body."
        ),
    ] = None,
    mass: Annotated[
        float | None,
        typer.Option(help="Mass of this cell, g: its density; without it that of the start file."),
    ] = None,
    soc0: options.Soc0 = None,
    temperature: Annotated[
        list[str] | None,
        typer.Option(
            "--temperature", help="FILE=DEGC, of a record without a temperature column; repeatable."
        ),
    ] = None,
    dates: Annotated[
        list[str] | None,
        typer.Option(
            "--date",
            help="FILE=YYYY-MM-DD, the day of a record: those of other days may be of another age; repeatable.",
        ),
    ] = None,
    as_of: Annotated[
        str | None,
        typer.Option(
            help="YYYY-MM-DD, the day of the state that the file is in; without it the last with a load."
        ),
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option(
            "--prior",
            help="NAME=VALUE:SD, what is known of a parameter from elsewhere, as the report names it; repeatable.",
        ),
    ] = None,
    hold: options.HoldOption = None,
    until: Annotated[
        list[str] | None,
        typer.Option("--until", help="FILE=SECONDS: read this record up to there; repeatable."),
    ] = None,
    impedance: Annotated[
        list[Path] | None,
        typer.Option(
            "--impedance", help="Measured spectra to hold the result against; nothing is fitted to them."
        ),
    ] = None,
    fit_impedance: Annotated[
        list[Path] | None,
        typer.Option(
            "--fit-impedance", help="Measured spectra of this very cell to fit beside the measurements."
        ),
    ] = None,
    posterior: Annotated[
        int,
        typer.Option("--posterior", min=0, help="Samples of each walker to draw from the posterior (emcee)."),
    ] = 0,
    starts: Annotated[
        int,
        typer.Option(
            "--starts",
            min=1,
            help="Number of fits: from the start file, and from cells drawn from the priors. The best is taken.",
        ),
    ] = 1,
    title: Annotated[str | None, typer.Option(help="Name of the cell in the file that is written.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the posterior's samples and of the drawn starts.")] = 0,
    model: options.ModelOption = None,
) -> None:
    """Fit the physics model's own parameters to measurements of any temperatures together."""
    read = [cell, *data, *(impedance or []), *(fit_impedance or [])]
    outputs.check_json(out, read, calibration_files(out))
    options.check_once("--data", data)
    temperatures = options.by_file("--temperature", temperature, data)
    days, day = options.dates(dates, data), options.day("--as-of", as_of)
    ends = options.by_file("--until", until, data)
    witnesses, spectra = options.spectra(impedance), options.spectra(fit_impedance)
    priors, limits, edges = options.priors(prior), options.cut_offs(cut_offs), options.body(body)
    options.say_reading(data)
    from aesi.calibration import Conditions
    from aesi.pipeline.calibrate import Request, check_request
    from flows.jobs.calibration import calibrate as flow

    conditions = Conditions(soc0, temperatures, days, day, model, spectra=spectra, priors=priors)
    request = Request(conditions, witnesses, limits, posterior, starts, seed, title, edges, mass)
    check_request(cell, request)
    records = options.measurements(data, reading, hold, ends)
    flow(cell, records, out, request)


def impedance(
    cell: options.CellOption,
    soc: Annotated[
        float, typer.Option(callback=options.share("--soc"), help="State of charge at rest, from 0 to 1.")
    ],
    frequencies: Annotated[
        str, typer.Option(help="CSV with a column frequency_hz, or LOW:HIGH:N for N of them, log-spaced.")
    ],
    out: Annotated[Path, typer.Option(help="CSV to write: frequency_hz, z_real_ohm, z_imag_ohm.")],
    temperature_degc: Annotated[float, typer.Option(help="Of the cell.")] = 25.0,
    effect: options.Effects = None,
    effect_file: options.EffectFiles = None,
    model: options.ModelOption = None,
    soh: options.SohOption = None,
) -> None:
    """The physics model in the frequency domain, at rest."""
    outputs.check_table(out, [cell, Path(frequencies), *(effect_file or [])])
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
        options.say_notes,
    )
    size = 1e3 * abs(z)
    typer.echo(f"{out}: {len(z):,} frequencies, |Z| {size.min():.4g} to {size.max():.4g} mOhm", err=True)


@options.reads_files
def discover(
    *,
    context: typer.Context,
    reading: Any,
    experiment: Annotated[
        Path | None, typer.Argument(help="An experiment file instead of --cell and --data.")
    ] = None,
    cell: options.CellUnlessExperiment = None,
    data: Annotated[
        list[Path] | None, typer.Option("--data", help="Measurement; may be given again.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for discovery.json, report.html and model/.")
    ] = None,
    test: Annotated[
        list[Path] | None,
        typer.Option("--test", help="Held-out measurement, for the error alone; may be repeated."),
    ] = None,
    good: Annotated[
        list[Path] | None,
        typer.Option(
            "--good", help="Known-good record of the same cell; the answer is how --data differs from it."
        ),
    ] = None,
    soc0: options.Soc0 = None,
    soh: options.SohOption = None,
    holdout: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=0.9,
            help="Last share of the data kept back, without --test: 0.3 where none is given.",
        ),
    ] = None,
    max_effects: options.MaxEffects = 3,
    seed: options.Seed = 0,
    effect_file: options.EffectFiles = None,
    hold: options.HoldOption = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only", help="Try only this effect; may be repeated. Parameters of all others stay as declared."
        ),
    ] = None,
    without: Annotated[
        list[str] | None, typer.Option("--without", help="Leave this effect out; may be repeated.")
    ] = None,
    model: Annotated[
        Literal["espm", "dfn"] | None,
        typer.Option(
            "--model",
            help="Single particle or porous electrode. Without it, where the two differ notably, both are searched, "
            "and the one that explains the data with fewer or likelier names is taken.",
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None, options.key_value("key=value laid over the experiment file.")
    ] = None,
    prefect: options.PrefectOption = True,
) -> None:
    """Close the loop: find what physics the model lacks, add it, and report the error before and after."""
    if out is not None:
        given = [*([cell] if cell else []), *(data or []), *(test or []), *(good or []), *(effect_file or [])]
        outputs.check_folder(out, given, discovery_files(out))
    if experiment is not None:
        options.check_unsaid(context, BESIDE_AN_EXPERIMENT)
        _discover_experiment(experiment, list(overrides or []), out, prefect)
        return
    if cell is None or not data or out is None:
        given = {"--cell": cell, "--data": data, "--out": out}
        lacking = " and ".join(option for option, value in given.items() if not value)
        raise InputError(f"give {lacking}{'' if any(given.values()) else ', or an experiment file'}.")
    if overrides:
        raise InputError(
            "--set changes a key of an experiment file, and none is given; use the options instead."
        )
    options.say_reading([*data, *(test or []), *(good or [])])
    from aesi.pipeline.discovery.cases import case_of_files
    from flows.jobs.start import discover as flow

    case = case_of_files(
        cell,
        data,
        test or [],
        good=good or [],
        reading=reading,
        hold=hold,
        soc0=soc0,
        holdout=holdout,
        max_effects=max_effects,
        seed=seed,
        effect_files=effect_file or [],
        only=only or [],
        without=without or [],
        model=model,
        soh=options.state_of_health(soh),
    )
    options.say_notes(note for m in case.records for note in m.notes)
    flow(case, out, prefect)


def _discover_experiment(experiment: Path, overrides: list[str], out: Path | None, prefect: bool) -> None:
    """The job of an experiment file. Raises InputError where its finding would be written over a file that it names."""
    options.say_reading([experiment])
    from aesi.pipeline.experiment.sources import named_files
    from flows.jobs.discovery import finding_folder
    from flows.jobs.run_request import RunRequest
    from flows.jobs.start import discover_experiment

    request = RunRequest(str(experiment), tuple(overrides))
    place = out or finding_folder(request.config)
    read = [experiment, *named_files(request.config).values()]
    outputs.check_folder(place, read, discovery_files(place))
    discover_experiment(request, out, prefect)


def export(
    cell: options.CellOption,
    to: Annotated[Literal["bpx", "pybamm"], typer.Option(help="A BPX file, or a script that PyBaMM runs.")],
    out: Annotated[Path, typer.Option(help="File to write: .json for bpx, .py for pybamm.")],
) -> None:
    """A cell, and what was found about it, for other tools; says what they cannot hold."""
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
