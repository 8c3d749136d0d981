"""The `aesi` command: arguments in, exit code out (0 done, 1 the job failed, 2 bad input or usage).

Commands live in `flows.commands`; each imports what it needs when it runs, so that --help stays instant.
"""

from __future__ import annotations

import sys

try:
    import errno
    import os
    from typing import NoReturn

    import typer

    from aesi.errors import AesiError, OwnEffectError
    from aesi.logins import without_logins
    from aesi.numerics.files.first_use import on_first_compilation
    from flows.base import environment
    from flows.base.interrupt import INTERRUPTED, ending_soon_on_interrupt, tell_interrupted
    from flows.commands import batch, bench, cell, data, effects, experiment
    from flows.commands.command import App
except KeyboardInterrupt:  # before anything hears Ctrl-C; none of it is worth a traceback
    print("Interrupted.", file=sys.stderr)
    sys.exit(130)

app = App(
    name="aesi",
    help="Hybrid lithium-ion cell models: physics, a sparse correction of its error, intervals, and a tracer "
    "that names the missing physics.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("run", short_help="Run an experiment, to its tables and report.")(experiment.run)
app.command("discover", short_help="Find which effects a model lacks, and add them.")(cell.discover)
app.command("calibrate", short_help="Fit the parameters of the physics model.")(cell.calibrate)
app.command("simulate", short_help="Simulate a cell under a current profile.")(cell.simulate)
app.command("impedance", short_help="Compute the impedance of a cell at rest.")(cell.impedance)
app.command("predict", short_help="Predict with a saved hybrid model.")(cell.predict)
app.command("batch", short_help="Run a discovery for each of many cells.")(batch.batch)
app.command("export", short_help="Write a cell as BPX or for PyBaMM.")(cell.export)
app.command("tables", short_help="Print the tables of tracked runs.")(experiment.tables)
app.command("effects", short_help="Show the catalogue of effects.")(effects.effects)
app.add_typer(data.app, name="data", help="List, fetch and convert measured data.")
app.command("worker", short_help="Evaluate candidates of a shared search.")(experiment.worker)
app.command("compare", short_help="Compare tracked runs on one page.")(experiment.compare)
app.command("candidate", short_help="Rebuild a tracked candidate and its model.")(experiment.candidate)
app.command("ui", short_help="Show runs, searches or flows in a browser.")(experiment.ui)
app.command("bench", short_help="Measure accuracy and time, beside other programs.")(bench.bench)


@app.callback(invoke_without_command=True)
def _version(version: bool = typer.Option(False, "--version", help="Print the version and exit.")) -> None:
    if version:
        from aesi import __version__

        typer.echo(f"aesi {__version__}")
        raise typer.Exit


def main() -> NoReturn:
    """Entry point of the `aesi` script."""
    try:
        with ending_soon_on_interrupt():
            environment.prepare_process()
            on_first_compilation(_say_compiling)
            app(args=repeated(sys.argv[1:]))
    except (AesiError, OwnEffectError) as error:
        if isinstance(error, OwnEffectError) and os.environ.get("AESI_DEBUG"):
            raise
        _fail(str(error), error.exit_code)
    except MemoryError:
        _fail("out of memory; use fewer library terms, a larger dt_s or fewer workers.", 1)
    except OSError as error:
        _fail(_os_sentence(error), 1)
    except SystemExit as error:
        if error.code == INTERRUPTED:
            tell_interrupted()
        raise
    except RecursionError:
        _fail("a file is nested too deeply to be read.", 2)
    except Exception as error:
        if os.environ.get("AESI_DEBUG"):
            raise
        _fail(f"unexpected {type(error).__name__}: {_first_line(error)} (AESI_DEBUG=1 shows where).", 1)
    raise SystemExit(0)


def _say_compiling() -> None:
    print(
        "Compiling a model for this machine, once each after an installation or an update: up to a minute ...",
        file=sys.stderr,
        flush=True,
    )


TAKE_LISTS = ("discover", "calibrate", "simulate", "impedance", "predict")
"""Commands that take several values after one option: those that read none by its place, or, with an experiment file,
none beside such an option."""
LISTS = (
    *("--data", "--test", "--good", "--impedance", "--fit-impedance", "--effect-file", "--effect"),
    *("--only", "--without", "--temperature", "--date", "--until", "--prior", "--soc0"),
    *("--column", "--unit", "--state-word"),
)
"""Their options that may be given again; `--set` stands beside an experiment file, which can follow it."""


def repeated(arguments: list[str]) -> list[str]:
    """`--data A B C` and `--data=A B C` as `--data A --data B --data C`, for every option that may be given again."""
    if not arguments or arguments[0] not in TAKE_LISTS:
        return arguments
    result: list[str] = []
    option, taken = "", False  # the last option, and whether it has a value
    for place, argument in enumerate(arguments):
        if argument == "--":
            return [*result, *arguments[place:]]
        if argument.startswith("-") and argument != "-":
            option, equals, _ = argument.partition("=")
            taken = bool(equals)
        else:
            if option in LISTS and taken:
                result.append(option)
            taken = True
        result.append(argument)
    return result


CLOSED = (errno.EACCES, errno.EPERM, errno.EROFS)
"""What a system says of a place that may not be written to."""


def _os_sentence(error: OSError) -> str:
    """What the system refused; of the workspace, where else it can be."""
    place = error.filename or "a file"
    words = f"{place}: {error.strerror or error}"
    home = environment.workspace()
    if str(place).startswith(str(home)) and (error.errno in CLOSED or not home.is_dir()):
        words += (
            "; runs and their tracking are kept in the current folder, or in the one that AESI_HOME names"
        )
    return f"{words}."


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or ["no message"])[0].rstrip(".")


def _fail(message: str, code: int) -> NoReturn:
    print(f"aesi: {without_logins(message)}", file=sys.stderr)
    raise SystemExit(code)


if __name__ == "__main__":
    main()
