"""Execute the notebooks in place, so that they are committed with what they print.

    python docs/hooks/notebooks.py [NOTEBOOK.ipynb ...]      all of notebooks/ where none is named

Paths of the machine are taken out of what is kept; figures are kept as plotly's own records, which notebook servers
draw.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[2]
TIMEOUT_S = 1800


def execute(path: Path) -> None:
    """Run one notebook from top to bottom and write it back with its outputs."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory(prefix="aesi-notebook-") as home:
        os.environ.update(
            AESI_HOME=home, TMPDIR=home, PLOTLY_RENDERER="plotly_mimetype", PYTHONPATH=str(ROOT)
        )
        NotebookClient(
            notebook, timeout=TIMEOUT_S, resources={"metadata": {"path": str(path.parent)}}
        ).execute()
        for cell in notebook.cells:
            cell.metadata.pop("execution", None)
            if cell.cell_type == "code":
                cell.outputs = [_kept(output, home) for output in cell.outputs if not _is_noise(output)]
    notebook.metadata.pop("widgets", None)
    nbformat.write(notebook, path)


def _is_noise(output: nbformat.NotebookNode) -> bool:
    """Warnings of other packages and progress on standard error tell readers nothing."""
    return bool(output.output_type == "stream" and output.name == "stderr")


def _kept(output: nbformat.NotebookNode, home: str) -> nbformat.NotebookNode:
    if output.output_type == "stream":
        output.text = output.text.replace(home, "FOLDER").replace(str(ROOT), "CHECKOUT")
    return output


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Execute notebooks in place.")
    parser.add_argument(
        "notebooks", nargs="*", type=Path, metavar="NOTEBOOK.ipynb", help="all without a name"
    )
    for path in parser.parse_args().notebooks or sorted((ROOT / "notebooks").glob("*.ipynb")):
        execute(path.resolve())
        print(path)
