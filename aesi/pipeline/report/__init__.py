"""Reports: one offline HTML file each, from a view (arrays and rows) that the pipeline builds.

The writers are imported where they are first used: they need the figures, which need the views of this package.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from aesi.pipeline.report.views import (
    BootstrapView,
    DiscoveryTrace,
    DiscoveryView,
    EffectView,
    ModelVoltage,
    RecordTrace,
    RunView,
)

if TYPE_CHECKING:
    from aesi.pipeline.report.page import write_figures
    from aesi.pipeline.report.write import write_discovery_report, write_run_report

_HOME = {
    "write_discovery_report": "aesi.pipeline.report.write",
    "write_figures": "aesi.pipeline.report.page",
    "write_run_report": "aesi.pipeline.report.write",
}

__all__ = [
    "BootstrapView",
    "DiscoveryTrace",
    "DiscoveryView",
    "EffectView",
    "ModelVoltage",
    "RecordTrace",
    "RunView",
    "write_discovery_report",
    "write_figures",
    "write_run_report",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'aesi.pipeline.report' has no attribute {name!r}")
