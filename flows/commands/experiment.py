"""Commands about experiments: run, worker, tables, compare, candidate, ui."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from aesi.errors import InputError
from aesi.pipeline.written import CANDIDATE, COMPARISON_MARK, candidate_files
from flows.commands import options, outputs

Experiment = Annotated[Path, typer.Argument(help="Experiment file (YAML), such as experiments/smoke.yaml.")]
Overrides = Annotated[
    list[str] | None,
    options.key_value(
        "KEY=VALUE that replaces a key of the experiment file, the value in YAML; may be repeated. Example: "
        "search.candidates=50."
    ),
]


def run(
    experiment: Experiment,
    overrides: Overrides = None,
    runner: Annotated[
        Literal["local", "dask"] | None,
        typer.Option(
            help="Where candidates are evaluated: in processes of this machine, or on a Dask cluster. Default: "
            "runner.kind of the experiment file."
        ),
    ] = None,
    address: Annotated[
        str | None,
        typer.Option(
            help="Address of the Dask scheduler, such as tcp://HOST:8786, with --runner dask or with runner.kind: dask "
            "in the experiment file. Default: that of the experiment file, else a cluster on this machine."
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the last unfinished run of this experiment.")
    ] = False,
    cache: Annotated[
        bool,
        typer.Option(
            "--cache/--no-cache", help="Use the results of earlier stages that had the same inputs."
        ),
    ] = True,
    prefect: options.PrefectOption = True,
) -> None:
    """Run an experiment: read and simulate the data, search for a correction, calibrate intervals, and write tables,
    figures and the report to runs/NAME."""
    from flows.jobs.start import start

    start(
        experiment,
        list(overrides or []),
        runner=runner,
        address=address,
        resume=resume,
        use_cache=cache,
        use_prefect=prefect,
    )


def worker(
    experiment: Experiment,
    overrides: Overrides = None,
) -> None:
    """Evaluate candidates of an experiment together with other processes, which share them through the workspace or
    through the database that runner.storage names."""
    from flows.jobs.worker import work

    work(experiment, list(overrides or []))


def tables(
    experiment: Annotated[str, typer.Argument(help="Name of an experiment, or its file.")],
    format: Annotated[
        Literal["md", "tex", "csv"],
        typer.Option(help="Format of the tables: Markdown, LaTeX or CSV."),
    ] = "md",
    run_id: Annotated[
        list[str] | None,
        typer.Option(
            "--run",
            help="Id of a tracked run to use, or its beginning; may be repeated. Default: the newest finished run of "
            "each seed.",
        ),
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Folder to which the tracked figures and reports are written as well.")
    ] = None,
    uri: Annotated[
        str | None,
        typer.Option(
            help="Address of the tracking store (MLflow). Default: that of the experiment file, else the store of the "
            "workspace."
        ),
    ] = None,
) -> None:
    """Print the tables of an experiment from its tracked runs alone, with mean and spread over several seeds."""
    if figures is not None:
        outputs.check_folder(figures, option="--figures")
    from flows.results.tables import tables_of, tracked_as

    _deliver(uri or tracked_as(experiment)[1])
    typer.echo(tables_of(experiment, format=format, run_ids=run_id or [], figures=figures, uri=uri))


def _deliver(uri: str | None) -> None:
    """Send to a tracking store what this workspace still holds back for it, before the store is read."""
    from flows.base.console import Console
    from flows.tracking.leftovers import deliver_leftovers
    from flows.tracking.store import Store

    deliver_leftovers(Store.to_read(uri), Console().say)


def compare(
    runs: Annotated[
        list[str],
        typer.Argument(
            help="Ids of tracked runs, their beginnings, or the folders that they wrote; a name of an experiment takes "
            "all its runs, and its discoveries in tables of their own."
        ),
    ],
    out: Annotated[Path, typer.Option(help="HTML file to write.")] = Path("compare.html"),
    uri: options.StoreUri = None,
) -> None:
    """Compare tracked runs on one HTML page that opens offline: their settings, their figures, maps of their errors."""
    outputs.check_page(out, COMPARISON_MARK)
    from aesi.pipeline.report.compare import counted_jobs, out_of_reach
    from flows.results.compare import compare as write

    _deliver(uri)
    shown = write(runs, out, uri)
    for sentence in out_of_reach(shown):
        typer.echo(sentence, err=True)
    typer.echo(f"{out}: {counted_jobs(shown)}", err=True)


def candidate(
    run_id: Annotated[
        str,
        typer.Argument(
            help="Id of a tracked candidate, or of a run, which takes the candidate that it chose."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder to write: model/ and candidate.json.")],
    uri: options.StoreUri = None,
) -> None:
    """Rebuild a candidate of a search, and its model, from the tracking store alone. The exit code is 1 if its figures
    differ from the tracked ones."""
    outputs.check_folder(out)
    outputs.check_own(out, candidate_files(out), [out / CANDIDATE])
    from flows.base.console import Console
    from flows.base.folder_lock import alone_in
    from flows.results.candidate import Differs, rebuild, rebuilt_line, save

    _deliver(uri)
    rebuilt = rebuild(run_id, uri)
    with alone_in(out):
        save(rebuilt, out)
    Console().say(rebuilt_line(rebuilt, out))
    if rebuilt.differing:
        raise Differs(rebuilt)


def ui(
    port: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=65535,
            help="TCP port to serve on. Default: 5000, with --optuna 8080, with --prefect 4200.",
        ),
    ] = None,
    host: Annotated[
        str,
        typer.Option(
            help="Address to serve on. The default can be reached from this machine only; 0.0.0.0 from the whole "
            "network."
        ),
    ] = "127.0.0.1",
    uri: options.StoreUri = None,
    optuna: Annotated[
        bool, typer.Option("--optuna", help="Show Optuna's dashboard of the searches, finished or running.")
    ] = False,
    prefect: Annotated[
        bool, typer.Option("--prefect", help="Show Prefect's pages of the flow runs in this workspace.")
    ] = False,
    storage: Annotated[
        str | None,
        typer.Option(
            help="URL of the database with the searches, as in runner.storage; with --optuna alone. Default: the "
            "journal of the workspace."
        ),
    ] = None,
) -> None:
    """Serve a web page with the tracked runs (MLflow), searches (Optuna) or flow runs (Prefect) until Ctrl-C."""
    if storage is not None and not optuna:
        raise InputError(
            "--storage is a database for Optuna's dashboard; give --optuna beside it, or leave it out."
        )
    if uri is not None and (optuna or prefect):
        raise InputError(
            "--uri names the store of the MLflow UI; leave it out beside --optuna and --prefect."
        )
    if optuna and prefect:
        raise InputError("--optuna and --prefect are two pages; start one at a time.")
    from flows.results.ui import serve, serve_flows, serve_studies

    if prefect:
        serve_flows(port=port or 4200, host=host)
    elif optuna:
        serve_studies(port=port or 8080, host=host, url=storage)
    else:
        serve(port=port or 5000, host=host, uri=uri)
