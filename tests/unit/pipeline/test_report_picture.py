"""The picture of the README, drawn from a report."""

import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from aesi.pipeline.report.write import write_discovery_report, write_run_report

HOOK = Path(__file__).resolve().parents[3] / "docs" / "hooks" / "picture.py"


@pytest.fixture(scope="module")
def picture():
    spec = spec_from_file_location("docs_picture", HOOK)
    module = module_from_spec(spec)
    sys.modules["docs_picture"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("n", [600, 9000])
def test_it_tells_the_error_that_the_run_had(picture, views, tmp_path, n):
    view = views.run_view(n)
    chosen = {t.name: replace(t.predictions[view.chosen], outside=t.current_a > 40) for t in view.traces}
    traces = (replace(t, predictions={**t.predictions, view.chosen: chosen[t.name]}) for t in view.traces)
    view = replace(view, traces=tuple(traces))
    write_run_report(tmp_path / "report.html", view)
    picture.main(str(tmp_path / "report.html"), str(tmp_path / "out.svg"))
    text = "".join(ET.parse(tmp_path / "out.svg").getroot().itertext())
    errors = [t.measured_v - t.predictions[view.chosen].free_run_v for t in view.of("test")]
    rmse_mv = 1e3 * np.sqrt(np.mean(np.concatenate(errors) ** 2))
    assert f"{view.chosen}: {rmse_mv:.1f} mV" in text
    assert "nan" not in text


def test_it_draws_a_discovery_too(picture, views, tmp_path):
    write_discovery_report(tmp_path / "report.html", views.discovery_view(600))
    picture.main(str(tmp_path / "report.html"), str(tmp_path / "out.svg"))
    text = "".join(ET.parse(tmp_path / "out.svg").getroot().itertext())
    assert text.index("as declared") < text.index("recalibrated") < text.index("with the finding added")


def test_another_page_is_refused(picture, tmp_path):
    page = tmp_path / "page.html"
    page.write_text("<html></html>")
    with pytest.raises(SystemExit, match="not a report"):
        picture.main(str(page), str(tmp_path / "out.svg"))


FINDING = HOOK.with_name("finding.py")


def test_a_finding_is_drawn_with_its_name_its_witness_and_the_errors_on_what_chose_nothing(views, tmp_path):
    view = views.discovery_view(600)
    write_discovery_report(tmp_path / "report.html", view)
    (tmp_path / "discovery.json").write_text(json.dumps(view.discovery))
    out = tmp_path / "out.svg"
    command = [sys.executable, FINDING, tmp_path, out, "--reference", "calorimeter: 1.3 W"]
    subprocess.run(command, check=True, env=os.environ | {"PYTHONPATH": str(HOOK.parents[2])})
    text = "".join(ET.parse(out).getroot().itertext())
    assert "self heating" in text
    assert "calorimeter: 1.3 W" in text
    tested = [t for t in view.traces if t.part == "test"]
    errors = np.concatenate([t.measured_v - t.after_v for t in tested])
    assert f"with the finding added: {1e3 * np.sqrt(np.mean(errors**2)):.1f} mV RMSE" in text
    assert "held out" in text
    assert "black: measured" in text
    assert "nan" not in text
