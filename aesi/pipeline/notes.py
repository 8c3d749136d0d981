"""Notes on records, said once for all the records they hold for."""

from __future__ import annotations

from collections.abc import Iterable

SEPARATOR = ": "


def together(notes: Iterable[str]) -> tuple[str, ...]:
    """`a: text`, `b: text` as `a, b: text`, in the order of the first of them."""
    subjects: dict[str, list[str]] = {}
    for note in notes:
        subject, separator, text = note.partition(SEPARATOR)
        subjects.setdefault(text if separator else "", []).append(subject if separator else note)
    alone = subjects.pop("", [])
    return (
        *(f"{', '.join(dict.fromkeys(names))}{SEPARATOR}{text}" for text, names in subjects.items()),
        *alone,
    )
