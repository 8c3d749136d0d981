"""The options of one call of `aesi run`."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from aesi.errors import InputError
from aesi.logins import login_to_fill_in, logins_to_fill_in, without_login, without_logins
from aesi.pipeline.experiment.config import (
    LIMITS,
    NO_PART,
    ExperimentConfig,
    overridden_key,
    read_experiment,
)

if TYPE_CHECKING:
    from aesi.pipeline.experiment.sources import Sources

UNTOLD = ("name", "seed", *NO_PART)
"""Sections that a title need not tell what was laid over: it does already, or they have no part in the result."""


@dataclass(frozen=True)
class RunRequest:
    """An experiment file, what is laid over it, and how to run it."""

    path: str
    overrides: tuple[str, ...] = ()
    runner: Literal["local", "dask"] | None = None
    address: str | None = None
    resume: bool = False
    use_cache: bool = True
    use_prefect: bool = True

    @cached_property
    def config(self) -> ExperimentConfig:
        """The experiment with all overrides, read once: who edits the file then edits that of the next run.

        Raises ConfigError for a file that is no experiment, InputError for an address that nobody would go to.
        """
        config = read_experiment(self.path, self.overrides)
        if self.runner is None and self.address is None:
            return config
        kind = self.runner or config.runner.kind
        if kind == "local" and self.address is not None:
            uses_none = ", and --runner local uses none" if self.runner else ""
            advice = (
                "leave one of the two out" if self.runner else "give --runner dask beside it, or leave it out"
            )
            raise InputError(f"--address {self.shown_address} names a Dask scheduler{uses_none}; {advice}.")
        address = (self.address or config.runner.address) if kind == "dask" else None
        runner = config.runner.model_copy(update={"kind": kind, "address": address})
        return config.model_copy(update={"runner": runner})

    @cached_property
    def sources(self) -> Sources | None:
        """The records of the user's files, read once and found to be different tests; None where there are no files.

        Raises DataError for records that cannot be used.
        """
        from aesi.pipeline.experiment.sources import cell_path, sources_of

        return sources_of(self.config, cell_path(self.config)) if self.config.data.kind == "files" else None

    @property
    def title(self) -> str:
        """What the run is called: `measured_nmc, seed 0`, with what is laid over the file and has a part in the result,
        `measured_nmc, seed 0: data.dt_s=2`."""
        keys = {text: overridden_key(text).split(".") for text in self.shown_overrides}
        told = [
            text
            for text, key in keys.items()
            if key[0] not in UNTOLD and not (key[0] == "search" and key[-1] in LIMITS)
        ]
        title = f"{self.config.name}, seed {self.config.seed}"
        return f"{title}: {', '.join(told)}" if told else title

    @property
    def shown_overrides(self) -> list[str]:
        """What is laid over the file, without the logins of the addresses in it."""
        return [without_logins(text) for text in self.overrides]

    @property
    def shown_address(self) -> str | None:
        """The address of the scheduler, without the login in it."""
        return None if self.address is None else without_login(self.address)

    @property
    def resuming(self) -> str:
        """The command line that goes on with what this one began; the logins of addresses in it are left to fill in."""
        words = ["aesi", "run", self.path]
        words += [word for text in self.overrides for word in ("--set", logins_to_fill_in(text))]
        words += ["--runner", self.runner] if self.runner else []
        words += ["--address", login_to_fill_in(self.address)] if self.address else []
        words += [] if self.use_cache else ["--no-cache"]
        words += [] if self.use_prefect else ["--no-prefect"]
        return shlex.join([*words, "--resume"])


class HandedOver:
    """A request on its way into a flow. Prefect keeps and shows what it can read of a parameter: nothing of this one,
    as it has no fields that can be listed."""

    __slots__ = ("request",)

    def __init__(self, request: RunRequest) -> None:
        self.request = request
