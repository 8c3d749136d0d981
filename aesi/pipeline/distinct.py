"""Whether every record is given once: what is fitted twice counts twice, and what judges may not be fitted."""

from __future__ import annotations

from collections.abc import Sequence

from aesi.errors import DataError
from aesi.records import Measurement, Spectrum


def check_distinct_spectra(fitted: Sequence[Spectrum], witnesses: Sequence[Spectrum] = ()) -> None:
    """Raises DataError, one sentence, for two spectra of the same frequencies and impedance.

    fitted : what a fit takes in.  witnesses : what its result is held against.
    """
    seen: dict[str, str] = {}
    for spectrum in fitted:
        if spectrum.digest in seen:
            raise DataError(
                f"{_both(seen[spectrum.digest], spectrum.name)} among the spectra to fit; give it once."
            )
        seen[spectrum.digest] = spectrum.name
    shown: dict[str, str] = {}
    for spectrum in witnesses:
        if spectrum.digest in seen:
            raise DataError(
                f"{_both(seen[spectrum.digest], spectrum.name)} among the spectra to fit and those to hold the result "
                "against; what is fitted is held against it anyway and judges nothing: give it once."
            )
        if spectrum.digest in shown:
            raise DataError(
                f"{_both(shown[spectrum.digest], spectrum.name)} among the spectra to hold the result against; give it "
                "once."
            )
        shown[spectrum.digest] = spectrum.name


def check_distinct(fitted: Sequence[Measurement], tests: Sequence[Measurement] = ()) -> None:
    """Raises DataError, one sentence, for two records that hold the same rows.

    fitted : what may be looked at.  tests : what chooses nothing.
    """
    seen: dict[str, str] = {}
    for record in fitted:
        if record.digest in seen:
            raise DataError(f"{_both(seen[record.digest], record.name)} among the data; give it once.")
        seen[record.digest] = record.name
    for record in tests:
        if record.digest in seen:
            raise DataError(
                f"{_both(seen[record.digest], record.name)} among the data and the tests; what is fitted cannot "
                "judge: name another test."
            )


def _both(one: str, other: str) -> str:
    """How a sentence begins about two records of the same rows."""
    if one == other:
        return f"{one} is there twice"
    return f"{one} and {other} hold the same rows and are both"
