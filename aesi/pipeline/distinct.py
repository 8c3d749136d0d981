"""Whether every record is given once: what is fitted twice counts twice, and what judges may not be fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aesi.errors import DataError
from aesi.records import Measurement, Spectrum

_Listed = Sequence[Measurement] | Sequence[Spectrum]


@dataclass(frozen=True)
class _Words:
    """What is said of two of the same content: both `fitted`, one fitted and one that judges (`between`), or both that
    judge (`judging`)."""

    fitted: str
    between: str
    judging: str


SPECTRA = _Words(
    "among the spectra to fit; give it once",
    "among the spectra to fit and those to hold the result against; what is fitted is held against it anyway and "
    "judges nothing: give it once",
    "among the spectra to hold the result against; give it once",
)
RECORDS = _Words(
    "among the data; give it once",
    "among the data and the tests; what is fitted cannot judge: name another test",
    "among the tests; what judges twice counts twice: give it once",
)


def check_distinct_spectra(fitted: Sequence[Spectrum], witnesses: Sequence[Spectrum] = ()) -> None:
    """Raises DataError, one sentence, for two spectra of the same frequencies and impedance.

    fitted : what a fit takes in.  witnesses : what its result is held against.
    """
    _check_once(fitted, witnesses, SPECTRA)


def check_distinct(fitted: Sequence[Measurement], tests: Sequence[Measurement] = ()) -> None:
    """Raises DataError, one sentence, for two records that hold the same rows.

    fitted : what may be looked at.  tests : what chooses nothing.
    """
    _check_once(fitted, tests, RECORDS)


def _check_once(fitted: _Listed, judging: _Listed, words: _Words) -> None:
    seen: dict[str, str] = {}
    for one in fitted:
        if one.digest in seen:
            raise _twice(seen[one.digest], one.name, words.fitted)
        seen[one.digest] = one.name
    judges: dict[str, str] = {}
    for one in judging:
        if one.digest in seen:
            raise _twice(seen[one.digest], one.name, words.between)
        if one.digest in judges:
            raise _twice(judges[one.digest], one.name, words.judging)
        judges[one.digest] = one.name


def _twice(one: str, other: str, where: str) -> DataError:
    """One sentence about two of the same content."""
    both = f"{one} is there twice" if one == other else f"{one} and {other} hold the same rows and are both"
    return DataError(f"{both} {where}.")
