"""The exports of cyclers that are known by the names of their columns: one file each, one line here."""

from __future__ import annotations

from collections.abc import Sequence

from aesi.data.readers.formats import (
    arbin,
    basytec,
    biologic,
    bitrode,
    digatron,
    kollmeyer,
    maccor,
    neware,
    novonix,
    pec,
)
from aesi.data.readers.formats.format import Format

FORMATS: tuple[Format, ...] = (
    arbin.FORMAT,
    maccor.FORMAT,
    biologic.FORMAT,
    bitrode.FORMAT,
    novonix.FORMAT,
    digatron.FORMAT,
    basytec.FORMAT,
    pec.FORMAT,
    neware.FORMAT,
    kollmeyer.FORMAT,
)


def recognise(header: Sequence[str]) -> Format | None:
    """The maker whose export has these names of columns; None where it is no maker's."""
    return next((one for one in FORMATS if one.recognises(header)), None)
