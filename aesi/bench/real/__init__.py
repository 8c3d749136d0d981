"""`aesi bench real`: findings on measured cells whose answer is known. `plan` lists the cases, `judged` judges one."""

from aesi.bench.real.case import RealCase, Take
from aesi.bench.real.judge import judged, lost
from aesi.bench.real.plan import chosen, plan
from aesi.bench.real.report import write_report
from aesi.bench.real.summary import summary
from aesi.bench.real.table import table

__all__ = ["RealCase", "Take", "chosen", "judged", "lost", "plan", "summary", "table", "write_report"]
