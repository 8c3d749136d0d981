"""Commands whose options are refused in one sentence, and taken once each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import typer
from typer.core import TyperCommand

from aesi.errors import InputError, wanted

MEANT = {"--model": "a saved model is given with --cell"}
"""Option that is a choice -> how the sentence on a value that is none of them goes on."""


class Command(TyperCommand):
    """A command that raises InputError, naming the option or its environment variable, for a value that is none and for
    an option that is there twice and cannot be: of two the last would count, and nobody be told."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """The arguments that are left."""
        if not ctx.resilient_parsing:  # as while a shell asks what could stand there
            _, _, given = self.make_parser(ctx).parse_args(list(args))
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


class App(typer.Typer):
    """A group of such commands."""

    def command(self, name: str | None = None, **how: Any) -> Callable[[Any], Any]:
        """As of typer."""
        return super().command(name, **{"cls": Command, **how})


def _sentence(option: str, fault: dict[str, Any]) -> str:
    if fault["type"] == "value_error":  # of a choice, which holds the value
        meant = f"; {MEANT[option]}" if option in MEANT else ""
        return f"{option}: {str(fault['ctx']['error']).rstrip('.')}{meant}."
    return f"{option} {fault['input']}: it {wanted(fault)}."
