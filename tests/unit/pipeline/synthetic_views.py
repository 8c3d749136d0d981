"""Synthetic views for the tests of the reports: made-up cells, so nothing here is a result."""

import numpy as np

from aesi.pipeline.report.views import (
    BootstrapView,
    DiscoveryTrace,
    DiscoveryView,
    EffectView,
    ModelVoltage,
    RecordTrace,
    RunView,
)


def drive(n, rng, dt_s=0.1):
    """Time, current and SOC of a drive that empties the cell over n samples."""
    time_s = dt_s * np.arange(n)
    steps = np.repeat(rng.normal(20, 30, n // 50 + 1), 50)[:n]
    current_a = np.convolve(steps, np.ones(20) / 20, mode="same")
    soc = 0.95 - 0.8 * np.arange(n) / n
    return time_s, current_a, soc


def trace(name, role, n, rng):
    time_s, current_a, soc = drive(n, rng)
    physics = 3.4 + 0.7 * soc - 1e-3 * current_a
    error = 0.015 * np.tanh(current_a / 40) - 0.01 * np.sin(6 * soc)
    measured = physics + error + 5e-4 * rng.standard_normal(n)
    predictions = {}
    for model, share in (("ESPM + AESI I", 0.75), ("ESPM + AESI II", 0.6)):
        free = physics + share * error
        one = measured + 4e-4 * rng.standard_normal(n)
        predictions[model] = ModelVoltage(
            free, free - 0.012, free + 0.012, one, one - 1e-3, one + 1e-3, outside=np.zeros(n, dtype=bool)
        )
    return RecordTrace(name, role, time_s, current_a, soc, measured, physics, predictions)


def model_row(name, terms, rmse_mv, mser):
    return {
        "name": name,
        "terms": terms,
        "free_run": {
            "train_mser_pct": mser + 5,
            "valid_mser_pct": mser + 2,
            "test_mser_pct": mser,
            "test_rmse_mv": rmse_mv,
        },
        "one_step": {"train_rmse_mv": 0.4, "test_rmse_mv": 0.5, "persistence_rmse_mv": 0.6},
        "k_step": {"1": 1.5, "10": 4.0, "60": 7.0},
        "intervals": {
            "nominal_pct": 90,
            "coverage_pct": 90.6,
            "average_width_v": 0.002,
            "winkler_v": 0.0025,
            "worst_bin_coverage_pct": 84.0,
        },
        "free_run_intervals": {"nominal_pct": 90, "coverage_pct": 91.0, "average_width_v": 0.024},
    }


def run_view(n=4000, seed=0, name="synthetic_cell"):
    """A run with every part of the view filled in; n samples a record."""
    rng = np.random.default_rng(seed)
    roles = (("UDDS", "train"), ("US06", "train"), ("Artemis", "valid"), ("SC03", "test"), ("NEDC", "test"))
    terms = [f"T1({v})" for v in ("e", "I", "c_sp", "c_sn", "c_e0", "c_eL")]
    terms += [
        f"{f}({v})" for f in ("sin", "tanh", "cosh") for v in ("e", "I", "c_sp", "c_sn", "c_e0", "c_eL")
    ]
    terms += [f"T1({a}) T1({b})" for a, b in (("e", "I"), ("I", "c_sp"), ("c_e0", "c_eL"))]
    candidates = [
        {
            "number": i,
            "oob": float(10 ** rng.uniform(-4, -1)),
            "valid": float(10 ** rng.uniform(-3, 0)),
            "terms": int(rng.integers(5, 120)),
            "fitness": float(rng.uniform(0.4, 0.95)),
            "feasible": bool(rng.random() > 0.2),
            "front": i % 12 == 0,
            "chosen": i == 24,
        }
        for i in range(150)
    ]
    candidates[24]["feasible"] = True
    return RunView(
        experiment=name,
        note="A made-up cell that shows every part of the report.",
        cell="synthetic 30 Ah cell",
        chosen="ESPM + AESI I",
        models=(
            {
                "name": "ESPM",
                "terms": 0,
                "free_run": {
                    "train_mser_pct": 0.0,
                    "valid_mser_pct": 0.0,
                    "test_mser_pct": 0.0,
                    "test_rmse_mv": 13.2,
                },
                "one_step": {"test_rmse_mv": 13.2, "persistence_rmse_mv": 0.6},
            },
            model_row("ESPM + AESI I", 27, 4.1, 90.3),
            model_row("ESPM + AESI II", 19, 5.9, 80.1),
        ),
        traces=tuple(trace(label, role, n, rng) for label, role in roles),
        candidates=tuple(candidates),
        terms=tuple(
            {
                "term": t,
                "importance": float(rng.gamma(1.0)),
                "bagging": float(rng.normal()),
                "stability": float(rng.normal()) if rng.random() > 0.4 else None,
                "inclusion": float(rng.uniform(0.3, 1)),
            }
            for t in terms
        ),
        bootstrap=BootstrapView((88_200,), 500, rng.normal(0.635, 0.01, 100)),
        settings={"lambda1": "1.2e-04", "lambda2": "0.31", "tau": "0.52", "p_c": "1", "d": "2"},
        notes=(
            "UDDS: 3 duplicate rows dropped at 12.4 s.",
            "Resampled from 1 Hz to 10 Hz by linear interpolation.",
        ),
        versions={"aesi": "0.1.0", "numpy": "2.4"},
        mlflow_run_id="0123456789abcdef",
        seconds=212.0,
    )


def discovery_row(effect, kind, score, rmse_mv):
    parameters = {
        "concentration_dependent_strength_factor": {"value": 1.25, "low": 1.1, "high": 1.4, "unit": "mohm"}
    }
    return {
        "effect": effect,
        "kind": kind,
        "score": score,
        "test_rmse_mv": rmse_mv,
        "parameters": parameters,
        "remark": "ends on a bound: concentration_dependent_diffusivity.negative_slope_at_full_charge",
    }


def discovery_view(n=4000, seed=0, verdict="found"):
    """A discovery with every part of the view filled in; n samples a file."""
    rng = np.random.default_rng(seed)
    effects = {"found": ["self_heating"], "none": [], "unknown": []}[verdict]
    refitted = {"fit": {"rmse_mv": 5.0}, "test": {"rmse_mv": 6.2}}
    return DiscoveryView(
        title="undeclared_effect",
        cell="synthetic 5 Ah cell",
        discovery={
            "schema": "aesi.discovery/1",
            "verdict": verdict,
            "effects": effects,
            "chosen": {"found": effects, "none": [], "unknown": ["series_resistance"]}[verdict],
            "indistinguishable": [["self_heating", "ambient_temperature"]] if effects else [],
            "confidence": 0.97,
            "before": {"fit": {"rmse_mv": 8.1}, "test": {"rmse_mv": 9.4}},
            "recalibrated": refitted,
            "after": {"fit": {"rmse_mv": 1.0}, "test": {"rmse_mv": 1.1}} if effects else refitted,
            "noise_floor_mv": 1.0,
            "explainable_mv": 0.2,
            "structured_mv": 4.0 if verdict == "unknown" else 0.3,
            "tolerance_mv": 0.8,
            "reason": "as the tracer words it",
            "candidates": [
                discovery_row("self_heating", "physics", 412.0, 1.1),
                discovery_row("ambient_temperature", "parameter", 405.0, 1.2),
                discovery_row("series_resistance", "physics", 120.0, 4.6),
                discovery_row("voltage_sensor_offset", "instrument", 14.0, 6.0),
                discovery_row("clock_skew", "instrument", 3.0, 6.2),
            ],
        },
        traces=tuple(
            discovery_trace(name, part, n, rng) for name, part in (("a.csv", "fit"), ("b.csv", "test"))
        ),
        effects=(
            EffectView(
                "self_heating",
                "self-heating",
                "physics",
                "m c_p dT/dt = I (U - V) - I T dU/dT - h A (T - T_amb)",
                "one lump, small Biot number.",
                "Bernardi, Pawlikowski & Newman (1985).",
                (
                    {
                        "name": "heat_transfer_w_k",
                        "unit": "W/K",
                        "value": 0.31,
                        "low": 0.27,
                        "high": 0.36,
                        "bounds": (0.01, 10.0),
                        "description": "heat transfer to the surroundings",
                    },
                ),
            ),
        )
        if effects
        else (),
        files=(
            file_row("a.csv", "fit", 8.1, 5.0, 1.0),
            file_row("b.csv", "test", 9.4, 6.2, 1.1),
        ),
        dependence=(
            {"variable": "temperature", "before": 0.62, "after": 0.02},
            {"variable": "current", "before": 0.21, "after": 0.01},
            {"variable": "SOC", "before": 0.08, "after": 0.03},
        ),
        points_to=(
            {
                "says": "current: an ohmic or a kinetic drop",
                "before": 0.4,
                "after": 0.0,
                "terms": ["tanh(I)"],
                "terms_after": [],
            },
        ),
        experiments=(
            {
                "effects": ["self_heating", "ambient_temperature"],
                "experiment": "a rest of two hours after a 1C discharge, with the case temperature logged",
            },
        ),
        titles={"self_heating": "self-heating", "ambient_temperature": "ambient temperature"},
        notes=("b.csv: the last 3 rows lie after a gap of 13 h and were dropped.",),
        versions={"aesi": "0.1.0"},
        mlflow_run_id="fedcba",
        seconds=64.0,
    )


def file_row(name, part, before, recalibrated, after):
    gain = recalibrated - after
    return {
        "name": name,
        "part": part,
        "before_mv": before,
        "recalibrated_mv": recalibrated,
        "after_mv": after,
        "gain_mv": gain,
        "gain_low_mv": gain - 0.4,
        "gain_high_mv": gain + 0.5,
    }


def discovery_trace(name, part, n, rng):
    time_s, current_a, soc = drive(n, rng, dt_s=1.0)
    measured = 3.4 + 0.7 * soc - 1e-3 * current_a + 1e-3 * rng.standard_normal(n)
    before = measured - 0.008 * np.tanh(current_a / 30) - 0.004
    recalibrated = measured - 0.005 * np.tanh(current_a / 30)
    after = measured - 1e-3 * rng.standard_normal(n)
    return DiscoveryTrace(name, part, time_s, current_a, soc, measured, before, recalibrated, after)
