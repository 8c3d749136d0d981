"""A constant at another value reaches every module that imported it (docs/hooks/constant.py)."""

import runpy
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

HOOK = Path(__file__).resolve().parents[2] / "docs" / "hooks" / "constant.py"


def test_a_replaced_constant_is_replaced_where_it_was_imported():
    spec = spec_from_file_location("docs_constant", HOOK)
    assert spec is not None
    assert spec.loader is not None
    hook = module_from_spec(spec)
    spec.loader.exec_module(hook)
    owner, reader = (
        import_module("aesi.physics.rest.open_circuit"),
        import_module("aesi.physics.initial_state"),
    )
    was = owner.CHARGED_V
    try:
        assert hook.replaced("aesi.physics.rest.open_circuit", "CHARGED_V", 2.0 * was) == was
        assert [2.0 * was] * 2 == [owner.CHARGED_V, reader.CHARGED_V]
    finally:
        hook.replaced("aesi.physics.rest.open_circuit", "CHARGED_V", was)
    assert was == reader.CHARGED_V


def test_a_worker_judged_with_the_constant_of_the_source_and_rows_of_it_were_taken_up(monkeypatch):
    """Processes that start anew import the file that was run as `__mp_main__`."""
    owner = import_module("aesi.physics.rest.open_circuit")
    digests = import_module("aesi.numerics.files.source_digest")
    monkeypatch.setattr(owner, "CHARGED_V", owner.CHARGED_V)  # put back afterwards, as is what follows
    monkeypatch.setattr(digests, "ALTERED", [])
    before, was = digests.source_digest.__wrapped__(), owner.CHARGED_V
    monkeypatch.setenv("AESI_CONSTANTS", f"aesi.physics.rest.open_circuit:CHARGED_V={2.0 * was}")
    try:
        runpy.run_path(str(HOOK), run_name="__mp_main__")
        assert 2.0 * was == owner.CHARGED_V
        assert digests.source_digest.__wrapped__() != before
    finally:
        import_module("aesi.physics.initial_state").CHARGED_V = was
