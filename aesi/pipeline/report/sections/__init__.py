"""Sections of a run's report: one file a section, registered here, shown in this order."""

from aesi.pipeline.report.sections import correction
from aesi.pipeline.report.sections.section import ReportSection

SECTIONS: tuple[ReportSection, ...] = (correction.SECTION,)

__all__ = ["SECTIONS", "ReportSection"]
