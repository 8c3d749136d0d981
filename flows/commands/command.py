"""Base class of the commands: an unknown option, a wrong value or a repeated option is refused with one sentence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, get_args

import typer
from typer.core import TyperCommand

from aesi.errors import InputError, nearest_name, wanted
from flows.commands.options import A_STATE, ITS_DEVIATION

MEANT = {
    "--model": "a saved model is given with --cell",
    "--soc0": "one record is given, and its state of charge is a number from 0 (empty) to 1 (full), without FILE=",
    "--soc": A_STATE,
    "--soc0-sd": ITS_DEVIATION,
}
"""Option -> end of the sentence on a value that is none of its choices, or no number."""
OF_RECORDS = ("current", "data")
"""Options, without their dashes, by which one command or another takes a record."""


class Command(TyperCommand):
    """A command that raises InputError, naming the option or its environment variable, for an unknown option, for an
    invalid value and for an option that is given twice but takes one value. Of two values the last would count without
    a message. Its help names what an option takes each time, not a list of it: several values are given by several
    options."""

    def __init__(self, *args: Any, **how: Any) -> None:
        super().__init__(*args, **how)
        for parameter in self.params:
            each = get_args(parameter.type_descriptor.annotation)
            if parameter.multiple and parameter.metavar is None and each:
                parameter.metavar = f"<{each[0].__name__.lower()}>"

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """The arguments that the options have not taken, as in click.  Raises InputError (see the class)."""
        if (
            not ctx.resilient_parsing
        ):  # set while a shell asks for completions, where a line may be incomplete
            try:
                _, left, given = self.make_parser(ctx).parse_args(list(args))
            except Exception as error:
                if type(error).__name__ != "NoSuchOption":  # of typer or of click, by the version of typer
                    raise
                raise InputError(self._unknown(str(vars(error)["option_name"]), ctx.command_path)) from None
            if left:
                raise InputError(
                    f"{' '.join(left)}: nothing is taken in this place; see {ctx.command_path} -h."
                )
            for parameter, times in Counter(given).items():
                if times > 1 and not (parameter.multiple or parameter.is_eager):
                    option = "/".join((*parameter.opts, *parameter.secondary_opts))
                    raise InputError(f"{option} is there twice; give it once.")
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            faults = getattr(error.__cause__, "errors", list)()
            if not faults or error.param is None:
                raise
            option, name = error.param.opts[0], str(error.param.name)
            source = ctx.get_parameter_source(name)
            if source is not None and source.name == "ENVIRONMENT":
                option = f"the environment variable {error.param.envvar} ="
            raise InputError(_sentence(option, faults[0])) from None

    def _unknown(self, option: str, command: str) -> str:
        """A sentence on an unknown option, with the nearest known one. A name by which other commands take records
        leads to this command's own, and the name of a quantity, such as time_s, to `--column`.  Names are compared
        without their dashes, which would make all of them alike."""
        named = {known.lstrip("-"): known for parameter in self.params for known in parameter.opts}
        instead = {name: known if known != name else f"{name} without --" for name, known in named.items()}
        instead |= {other: named[one] for one in OF_RECORDS if one in named for other in OF_RECORDS}
        if "column" in named:
            from aesi.data.channels.columns import QUANTITIES

            instead |= {quantity: f"--column {quantity}=..." for quantity in QUANTITIES}
        near = nearest_name(option.lstrip("-"), instead)
        meant = "." if near is None else f"; did you mean {instead[near]}?"
        return f"{command} has no option {option}{meant} See {command} -h."


class App(typer.Typer):
    """A group whose commands are of the class `Command`."""

    def command(self, name: str | None = None, **how: Any) -> Callable[[Any], Any]:
        """The decorator of `typer.Typer.command`, with `Command` as the default class."""
        return super().command(name, **{"cls": Command, **how})


def _sentence(option: str, fault: dict[str, Any]) -> str:
    meant = f"; {MEANT[option]}" if option in MEANT else ""
    if fault["type"] == "value_error":  # from a list of choices; its message contains the value
        return f"{option}: {str(fault['ctx']['error']).rstrip('.')}{meant}."
    return f"{option} {fault['input']}: it {wanted(fault)}{meant}."
