"""Commands about experiments: run, worker, tables, ui."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from aesi.errors import InputError
from flows.commands import options, outputs

Experiment = Annotated[Path, typer.Argument(help="An experiment file, for instance experiments/smoke.yaml.")]
Overrides = Annotated[
    list[str] | None, options.key_value("key=value laid over the file: search.candidates=50.")
]


def run(
    experiment: Experiment,
    overrides: Overrides = None,
    runner: Annotated[
        Literal["local", "dask"] | None, typer.Option(help="Who evaluates the candidates.")
    ] = None,
    address: Annotated[
        str | None,
        typer.Option(help="Dask scheduler; without it that of the file, else a cluster on this machine."),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the last unfinished run.")] = False,
    cache: Annotated[
        bool, typer.Option("--cache/--no-cache", help="Use what was computed before from the same content.")
    ] = True,
    prefect: options.PrefectOption = True,
) -> None:
    """The whole flow: data, physics, search, ensembles, intervals, tables, figures, report."""
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
    """One more process on a shared study: evaluates candidates of an experiment that others also work on."""
    from flows.jobs.worker import work

    work(experiment, list(overrides or []))


def tables(
    experiment: Annotated[str, typer.Argument(help="Name of an experiment, or its file.")],
    format: Annotated[Literal["md", "tex", "csv"], typer.Option(help="Markdown, LaTeX or CSV.")] = "md",
    run_id: Annotated[
        list[str] | None, typer.Option("--run", help="Only this tracked run; may be repeated.")
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Also write the tracked figures and reports to this folder.")
    ] = None,
    uri: Annotated[
        str | None,
        typer.Option(help="Tracking store; without it that of the experiment's file, else the workspace's."),
    ] = None,
) -> None:
    """The paper's tables from tracked runs alone, with mean and spread where there are several seeds."""
    if figures is not None:
        outputs.check_folder(figures, option="--figures")
    from flows.results.tables import tables_of, tracked_as

    _deliver(uri or tracked_as(experiment)[1])
    typer.echo(tables_of(experiment, format=format, run_ids=run_id or [], figures=figures, uri=uri))


def _deliver(uri: str | None) -> None:
    """Hand to a store what waits for it in this workspace, before it is read."""
    from flows.base.console import Console
    from flows.tracking.leftovers import deliver_leftovers
    from flows.tracking.store import Store

    deliver_leftovers(Store.to_read(uri), Console().say)


def compare(
    runs: Annotated[
        list[str],
        typer.Argument(help="Tracked runs (the beginning of their ids), or experiments for all of theirs."),
    ],
    out: Annotated[Path, typer.Option(help="The page to write.")] = Path("compare.html"),
    uri: options.StoreUri = None,
) -> None:
    """Tracked runs side by side on one offline page: what differed, what came of it, where the error is."""
    outputs.check_page(out)
    from flows.results.compare import compare as write

    _deliver(uri)
    shown = write(runs, out, uri)
    typer.echo(f"{out}: {len(shown)} runs", err=True)


def candidate(
    run_id: Annotated[str, typer.Argument(help="A tracked candidate, or a run for the one that it chose.")],
    out: Annotated[Path, typer.Option(help="Folder for model/ and candidate.json.")],
    uri: options.StoreUri = None,
) -> None:
    """A candidate of a search made again from the tracking store alone, with its model."""
    outputs.check_folder(out)
    from flows.base.console import Console
    from flows.base.folder_lock import alone_in
    from flows.results.candidate import Differs, rebuild, said, save

    _deliver(uri)
    rebuilt = rebuild(run_id, uri)
    with alone_in(out):
        save(rebuilt, out)
    Console().say(said(rebuilt, out))
    if rebuilt.differing:
        raise Differs(rebuilt)


def ui(
    port: Annotated[
        int | None,
        typer.Option(min=1, max=65535, help="5000 without it; 8080 with --optuna, 4200 with --prefect."),
    ] = None,
    host: Annotated[str, typer.Option(help="Loopback unless you say otherwise.")] = "127.0.0.1",
    uri: options.StoreUri = None,
    optuna: Annotated[
        bool, typer.Option("--optuna", help="Optuna's dashboard, also while a search runs.")
    ] = False,
    prefect: Annotated[
        bool, typer.Option("--prefect", help="Prefect's server on the flow runs here.")
    ] = False,
    storage: Annotated[
        str | None,
        typer.Option(help="With --optuna: a database, as in runner.storage; else the workspace's journal."),
    ] = None,
) -> None:
    """The MLflow UI on the tracking store in use, Optuna's dashboard on the searches, or Prefect on the flow runs."""
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
