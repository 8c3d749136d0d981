"""The loop closed on measured data: competing hypotheses, selection, verdict."""

from aesi.tracer.discovery import Discovery, discover

__all__ = ["Discovery", "discover"]
