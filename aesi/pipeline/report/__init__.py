"""Reports: one offline HTML file each, from a view (arrays and rows) that the pipeline builds."""

from aesi.pipeline.report.page import write_figures
from aesi.pipeline.report.views import (
    BootstrapView,
    DiscoveryTrace,
    DiscoveryView,
    EffectView,
    Prediction,
    RunView,
    Trace,
)
from aesi.pipeline.report.write import write_discovery_report, write_run_report

__all__ = [
    "BootstrapView",
    "DiscoveryTrace",
    "DiscoveryView",
    "EffectView",
    "Prediction",
    "RunView",
    "Trace",
    "write_discovery_report",
    "write_figures",
    "write_run_report",
]
