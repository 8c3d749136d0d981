"""What is done to the records of a case before it is searched."""

from aesi.pipeline.discovery.budget import within_budget
from aesi.pipeline.discovery.cold import with_cold_admitted
from aesi.pipeline.discovery.discover import Case
from aesi.pipeline.distinct import check_distinct


def searchable(case: Case) -> Case:
    """The case with its records thinned to what a search can be run on, and a note on each that is of its cell only in
    the cold.

    Raises DataError for a record that is given twice, or that cannot be of the cell at any temperature that is looked
    for.
    """
    check_distinct((*case.measurements, *case.good), case.tests, led=True)
    return with_cold_admitted(within_budget(case))
