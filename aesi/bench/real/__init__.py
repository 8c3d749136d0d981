"""`aesi bench real`: does the tracer find what a measured cell lacks, where the answer is known?

The answer is known because a fault was added to the record, because a measured quantity was withheld from the tracer,
or because the cell was measured independently. `plan` lists the cases, `judged` runs one of them.
"""

from aesi.bench.real.case import RealCase, Take
from aesi.bench.real.judge import judged, lost
from aesi.bench.real.plan import chosen, plan
from aesi.bench.real.report import write_report
from aesi.bench.real.summary import summary
from aesi.bench.real.table import table

__all__ = ["RealCase", "Take", "chosen", "judged", "lost", "plan", "summary", "table", "write_report"]
