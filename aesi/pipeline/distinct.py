"""Whether every record is given once: what is fitted twice counts twice, and what judges may not be fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from aesi.errors import DataError
from aesi.over_time import stamp
from aesi.records import Measurement, Spectrum
from aesi.records.overlap import overlap
from aesi.records.rows import Overlap, Rows
from aesi.tracer.case.records import leading_record

_Listed = Sequence[Measurement] | Sequence[Spectrum]


@dataclass(frozen=True)
class _Words:
    """Phrases for two records, or spectra, of the same content: both fitted (`fitted`), one fitted and one that
    judges (`between`), or both that judge (`judging`)."""

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


def check_distinct_spectra(fitted: Sequence[Spectrum], compared: Sequence[Spectrum] = ()) -> None:
    """Raises DataError, one sentence, for two spectra of the same frequencies and impedance.

    fitted : what a fit takes in.  compared : what its result is compared with.
    """
    _check_once(fitted, compared, SPECTRA)


def check_distinct(
    fitted: Sequence[Measurement], tests: Sequence[Measurement] = (), *, led: bool = False
) -> None:
    """Raises DataError, one sentence, for two records that hold the same rows, in whole or in part, as they are or
    shifted in time, rounded, thinned or resampled.

    fitted : what may be looked at.  tests : what chooses nothing.
    led : a test that begins with a fitted record is judged where that ends.
    """
    _check_once(fitted, tests, RECORDS)
    rows = {id(record): Rows(record) for record in (*fitted, *tests)}
    pairs = [
        *((*pair, RECORDS.fitted) for pair in combinations(fitted, 2)),
        *(
            (one, test, RECORDS.between)
            for one in fitted
            for test in tests
            if not (led and _is_continuation(test, one))
        ),
        *((*pair, RECORDS.judging) for pair in combinations(tests, 2)),
    ]
    for one, other, where in pairs:
        found = overlap(rows[id(one)], rows[id(other)])
        if found is not None:
            raise _overlap_error(one.name, other.name, found, where)


def _is_continuation(test: Measurement, known: Measurement) -> bool:
    """Whether a test begins with the rows of a known record, and goes on after them."""
    found = leading_record(test, [known])
    return found is not None and found[1] is test


def _check_once(fitted: _Listed, judging: _Listed, words: _Words) -> None:
    """Raises DataError for two records, or spectra, of the same digest."""
    seen: dict[str, str] = {}
    for one in fitted:
        if one.digest in seen:
            raise _repeated_error(seen[one.digest], one.name, words.fitted)
        seen[one.digest] = one.name
    judges: dict[str, str] = {}
    for one in judging:
        if one.digest in seen:
            raise _repeated_error(seen[one.digest], one.name, words.between)
        if one.digest in judges:
            raise _repeated_error(judges[one.digest], one.name, words.judging)
        judges[one.digest] = one.name


def _repeated_error(one: str, other: str, where: str) -> DataError:
    """The error on two of the same content.  where : of `_Words`."""
    both = f"{one} is there twice" if one == other else f"{one} and {other} hold the same rows and are both"
    return DataError(f"{both} {where}.")


def _overlap_error(one: str, other: str, found: Overlap, where: str) -> DataError:
    """The error on two records that share rows.  where : of `_Words`."""
    way = "later" if found.ahead_s > 0 else "earlier"
    clock = f", {stamp(abs(found.ahead_s))} s {way} than in {one}" if found.ahead_s else ""
    same = "one test on other times" if found.resampled else "the same rows of one test"
    return DataError(
        f"{one} and {other} hold {same} ({found.rows:,} rows, in {other} from "
        f"{stamp(found.from_s)} to {stamp(found.to_s)} s{clock}), and are both {where}."
    )
