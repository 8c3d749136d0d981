"""A calibration in words, from the content of its report in JSON: as Markdown, and what its records leave open."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from aesi.advice import listed
from aesi.calibration.result import until_words
from aesi.calibration.uncertainty.health import HEALTH_WORDS
from aesi.calibration.uncertainty.pulse_resistance import LATEST_S
from aesi.over_time import range_words
from aesi.physics.cell.energies import SPAN_K
from aesi.physics.simulation import MODEL_WORDS
from aesi.pipeline.digits import resolving
from aesi.pipeline.report.words.sizes import capitalised

NAMED_OPEN = 3
"""Parameters that the sentence on what is left open names: it is a line on a console, and the report has all."""
ERRORS_OF_FIT = (
    "after, with the capacity (over the file's), initial state and offset of the current sensor that were fitted to "
    "this record alone; as simulated, the file as it is, with the current as measured"
)
"""What the two errors of a record differ by."""


def open_line(content: Mapping[str, Any]) -> str:
    """One sentence on what the records leave open; empty where they tell every parameter."""
    left = content["undetermined"]
    if not left:
        return ""
    heaviest = list(dict.fromkeys(max(o["weights"], key=lambda name: abs(o["weights"][name])) for o in left))
    named = ", ".join(heaviest[:NAMED_OPEN]) + (" and others" if len(heaviest) > NAMED_OPEN else "")
    return (
        f"these records determine {len(content['parameters']) - len(left)} of {len(content['parameters'])} "
        f"combinations of parameters better than their priors do; the others ({named}) stay near the priors"
    )


def to_text(content: Mapping[str, Any]) -> str:
    """The report as Markdown."""
    lines = [f"# Calibration of {content['cell']}", "", f"Fitted with {MODEL_WORDS[content['model']]}.", ""]
    lines += [line for warning in content["warnings"] for line in (f"**Warning:** {warning}", "")]
    lines += [*_files(content), "", *_health(content), "", *_pulses(content), "", *_parameters(content)]
    if content["impedance"]:
        lines += ["", *_impedance(content)]
    sections = (
        ("Left open by these data", [o["sentence"] for o in content["undetermined"]]),
        ("On a bound", content["at_bounds"]),
        ("Notes", content["notes"]),
    )
    for title, texts in sections:
        if texts:
            lines += ["", f"## {title}", "", *(f"- {text}" for text in texts)]
    return "\n".join(lines) + "\n"


def errors_apart(content: Mapping[str, Any]) -> str:
    """What a record's error after the fit and that of the file as simulated are of; '' where no two differ as shown."""
    apart = any(f"{f['after_rmse_mv']:.2f}" != as_simulated(f) for f in content["files"])
    return ERRORS_OF_FIT if apart else ""


def _files(content: Mapping[str, Any]) -> list[str]:
    rows = [
        f"| {f['name']} | {_at(f['temperature_degc'], content['declared_degc'])} "
        f"| {f['before_rmse_mv']:.2f} | {f['after_rmse_mv']:.2f} | {as_simulated(f)} "
        f"| {f['capacity_share']:.3f} |"
        for f in content["files"]
    ]
    return [
        "| file | mean temperature, degC | before, mV | after, mV | as simulated, mV | capacity |",
        "|---|---|---|---|---|---|",
        *rows,
        "",
        f"Errors are RMSE on the data that were fitted: {ERRORS_OF_FIT}.",
    ]


def as_simulated(row: Mapping[str, Any]) -> str:
    """'4.20', or where the file runs out '830.65 (12.30 mV until it runs out at 74520 s)': mV RMSE of the written file
    on a record."""
    return f"{row['as_simulated_rmse_mv']:.2f}{until_words(row['ran_out_s'], row['until_ran_out_rmse_mv'])}"


def _health(content: Mapping[str, Any]) -> list[str]:
    rows = [f"| {HEALTH_WORDS[name]} | {_with_interval(p)} |" for name, p in content["health"].items()]
    assumed = content["size_assumed"]
    said = ["", capitalised(assumed)] if assumed else []
    return ["| state of health | value | 95 % interval |", "|---|---|---|", *rows, *said]


def _pulses(content: Mapping[str, Any]) -> list[str]:
    told = content["pulse_resistance"]
    rows = [
        f"| {row['temperature_degc']:g}{'' if row['fitted'] else ' *'} | {' | '.join(_ohms(row))} |"
        for row in told["rows"]
    ]
    at = " | ".join(f"at {100 * soc:.0f} % charge" for soc in told["soc"])
    return [
        f"| degC | {at} |",
        f"|---|{'---|' * len(told['soc'])}",
        *rows,
        "",
        pulse_sentence(content),
        *([OUTSIDE] if not all(row["fitted"] for row in told["rows"]) else []),
    ]


OUTSIDE = (
    f"\\* no record within {SPAN_K:g} K: the intervals are mostly those of the activation energies' priors."
)


def pulse_sentence(content: Mapping[str, Any]) -> str:
    """What the resistances and their intervals are."""
    told = content["pulse_resistance"]
    model_error_pct = told["model_error_pct"]
    off = (
        "without what the model itself is off by, since no record has such a pulse"
        if model_error_pct is None
        else f"and what the file is off by at such pulses in them, {model_error_pct:.2g} % RMS"
    )
    return (
        f"Resistance of a discharge at 1C for {told['seconds']:g} s from rest, mohm, with 95 % intervals: what these "
        f"records leave open, {off}.{_left_out(told.get('left_out', {}))}"
    )


def _left_out(pulses: Mapping[str, int]) -> str:
    """A sentence, with a space before it, on the pulses that were not read, record -> their number; '' without such."""
    if not pulses:
        return ""
    counted = listed([f"{count} in {record}" for record, count in pulses.items()])
    return (
        f" Left out of them: {counted}, since rows more than {LATEST_S:g} s apart leave open when the pulse begins, so "
        "that its resistance would be read too low; log a row a second there."
    )


def _ohms(row: Mapping[str, Any]) -> list[str]:
    """'42.2 [40.4, 44.1]' for each state of charge."""
    values = zip(row["mohm"], row["low_mohm"], row["high_mohm"], strict=True)
    return [
        "cannot give the pulse" if value is None else f"{value:.3g} [{low:.3g}, {high:.3g}]"
        for value, low, high in values
    ]


def best_known_first(content: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The parameters, each with its name, by the share of their priors' width that the records leave."""
    return sorted(
        ({"name": name, **row} for name, row in content["parameters"].items()),
        key=lambda row: 1.0 if row["of_prior"] is None else row["of_prior"],
    )


def _parameters(content: Mapping[str, Any]) -> list[str]:
    rows = [
        f"| {p['name']} | {_with_interval(p)} | {p['unit']} | {_percent(p['of_prior'])} | {p['prior_from']} |"
        for p in best_known_first(content)
    ]
    return [
        "Of prior: the width of the interval, as a share of the prior's; the best-determined parameter first. At 100 % "
        "the records do not determine the parameter.",
        "",
        "| parameter | value | 95 % interval | unit | of prior, % | prior from |",
        "|---|---|---|---|---|---|",
        *rows,
    ]


def _impedance(content: Mapping[str, Any]) -> list[str]:
    low, high = content["impedance"][0]["band_hz"]
    rows = [
        f"| {s['name']} | {s['soc']:.3f} | {_number(s['temperature_degc'])} | {_number(s['rms_pct'])} | "
        f"{'yes' if s['fitted'] else 'no'} |"
        for s in content["impedance"]
    ]
    return [
        f"## Impedance, {low:g} to {high:g} Hz",
        "",
        "| spectrum | state of charge | degC | root mean square of the error of abs(Z), % | fitted |",
        "|---|---|---|---|---|",
        *rows,
    ]


def _at(measured_degc: float | None, declared_degc: float) -> str:
    """The temperature of a record, or that of the cell file, at which it was taken."""
    return f"{declared_degc:.1f}, as declared" if measured_degc is None else _number(measured_degc)


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100.0 * min(share, 1.0):.0f}"


def _with_interval(row: Mapping[str, Any]) -> str:
    """'14.298 | 14.293 to 14.303'."""
    value, low, high = (row[key] for key in ("value", "low", "high"))
    if low is None or high is None:
        return f"{value:.4g} | not fitted; the notes say what it rests on"
    n = resolving(value, low, high, least=4)
    return f"{value:.{n}g} | {range_words(f'{low:.{n}g}', f'{high:.{n}g}')}"


def _number(value: float | None) -> str:
    return "" if value is None or not np.isfinite(value) else f"{value:.1f}"
