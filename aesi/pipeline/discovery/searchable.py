"""What is done to the records of a case before it is searched."""

from aesi.advice import listed
from aesi.errors import InputError
from aesi.pipeline.discovery.budget import within_budget
from aesi.pipeline.discovery.cold import with_cold_admitted
from aesi.pipeline.discovery.discover import Case
from aesi.pipeline.distinct import check_distinct


def searchable(case: Case) -> Case:
    """The case with its records thinned to what a search can be run on, and a note on each that is of its cell only in
    the cold.

    Raises DataError for a record that is given twice, or that cannot be of the cell at any temperature that is looked
    for; InputError where no effect is left to try.
    """
    _check_some_tried(case)
    check_distinct((*case.measurements, *case.good), case.tests, led=True)
    return with_cold_admitted(within_budget(case))


def _check_some_tried(case: Case) -> None:
    """Raises InputError where effects may be added, and the declared model has each that may be tried already."""
    if case.max_effects and not case.competing():
        tried = case.tried()
        had = f"the declared model has {listed([*tried])} already" if tried else "every effect is left out"
        raise InputError(f"{had}, so that none is left to try; name another one, or restrict them less.")
