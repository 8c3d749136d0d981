"""A constant at another value reaches every module that imported it (docs/hooks/constant.py)."""

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
        import_module("aesi.physics.start.open_circuit"),
        import_module("aesi.physics.initial_state"),
    )
    was = owner.CHARGED_V
    try:
        assert hook.replaced("aesi.physics.start.open_circuit", "CHARGED_V", 2.0 * was) == was
        assert [2.0 * was] * 2 == [owner.CHARGED_V, reader.CHARGED_V]
    finally:
        hook.replaced("aesi.physics.start.open_circuit", "CHARGED_V", was)
    assert was == reader.CHARGED_V
