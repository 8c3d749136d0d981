"""Advice for every reader. Sentences name the options of a command; here stand their names for whoever uses none.

The doors through which a reader comes add them: an experiment file's keys where such a file is read, Python's arguments
where a function of the package is called.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import wraps
from typing import Literal, ParamSpec, TypeVar

from aesi.errors import AesiError

Reader = Literal["command", "experiment", "python"]
"""Whom a sentence is for: who gave a command options, wrote an experiment file, or called a function."""

KEYS = {
    "--sign": "data.sign",
    "--column": "data.columns",
    "--unit": "data.units",
    "--state": "data.columns: {state: COLUMN}",
    "--state-word": "data.state_words",
    "--duplicates": "data.duplicates",
    "--soc0": "cell.soc0",
    "--soc0 FILE=SOC": "cell.soc0_of",
    "--step": "a file of its own, by `aesi data convert --step`",
    "--to-s": "data.to_s",
    "--from-s": "data.from_s",
    "--soh": "cell.soh",
}
"""Option of a command that reads files -> the key of an experiment file with the same meaning."""

OF_READING = {
    "--column": "columns",
    "--unit": "units",
    "--sign": "sign",
    "--state": "state",
    "--state-word": "state_words",
    "--cycle": "cycle",
    "--step": "step",
    "--from-s": "start_s",
    "--to-s": "stop_s",
    "--duplicates": "duplicates",
}
"""Option of a command that reads files -> the argument of `aesi.read_measurement` with the same meaning."""

OF_CALL = {
    "--soc0": "soc0",
    "--hold": "hold",
    "--soh": "soh",
    "--model": "model",
    "--data": "data",
    "--test": "tests",
    "--good": "good",
    "--holdout": "holdout",
    "--effect-file": "effect_files",
    "--temperature": "temperatures_degc",
    "--date": "dates",
    "--prior": "priors",
}
"""Option of other commands -> the argument of the same meaning, in the functions that have one."""

OF_RECORD = {"--soc0 FILE=SOC": "begun_at"}
"""Option for one of several records -> the method of `aesi.Measurement` with the same meaning."""

OF_PLAN = {"--soc0": "soc0", "--soc0 FILE=SOC": "soc0", "--soh": "soh"}
"""Option of other commands -> the column of a batch's table with the same meaning."""

OPTION = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]*(?: FILE=SOC)?")
"""An option; one that is given for one of several records with what it takes."""
TELLS_APART = ("in Python", "on the command line")
"""What a sentence holds that speaks to both readers by itself."""

Arguments = ParamSpec("Arguments")
T = TypeVar("T")


def told(reader: Reader, sentence: str) -> str:
    """The sentence as that reader can follow it."""
    if reader == "experiment":
        return with_keys(sentence)
    return with_arguments(sentence) if reader == "python" else sentence


def with_keys(sentence: str) -> str:
    """The sentence, with the keys of an experiment file added that mean the same as the options it names."""
    options = OPTION.findall(sentence)
    keys = [key for option, key in KEYS.items() if option in options]
    return f"{sentence.removesuffix('.')} (in an experiment file: {', '.join(keys)})." if keys else sentence


def with_arguments(sentence: str) -> str:
    """The sentence, with the arguments of Python's functions added that mean the same as the options it names."""
    if any(words in sentence for words in TELLS_APART):
        return sentence
    options = dict.fromkeys(OPTION.findall(sentence))
    of_reading = [OF_READING[option] for option in options if option in OF_READING]
    names = [OF_CALL[option] for option in options if option in OF_CALL]
    names += [f"{OF_RECORD[option]} of aesi.Measurement" for option in options if option in OF_RECORD]
    if of_reading:
        names.append(f"{listed(of_reading)} of aesi.read_measurement")
    return f"{sentence.removesuffix('.')} (in Python: {'; '.join(names)})." if names else sentence


def with_columns(sentence: str) -> str:
    """The sentence, with what its options are for one cell of a batch: a column of the table, or a file that is written
    anew, since a batch reads the files of all its cells alike."""
    options = dict.fromkeys(OPTION.findall(sentence))
    columns = [OF_PLAN[option] for option in options if option in OF_PLAN]
    told = [f"the column {listed(columns)} of the batch's table"] if columns else []
    if any(option in OF_READING for option in options):
        told.append(
            "in a batch these options hold for all cells; for this one alone give them to `aesi data convert`; what is "
            "no record belongs in another folder"
        )
    return f"{sentence.removesuffix('.')} ({'; '.join(told)})." if told else sentence


def advises_python(function: Callable[Arguments, T]) -> Callable[Arguments, T]:
    """The function as a door for Python: what it raises on purpose also names the arguments that its advice means."""

    @wraps(function)
    def door(*args: Arguments.args, **kwargs: Arguments.kwargs) -> T:
        try:
            return function(*args, **kwargs)
        except AesiError as error:
            error.args = (with_arguments(str(error)), *error.args[1:])
            raise

    return door


def listed(names: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"
