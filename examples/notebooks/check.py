"""Runs the notebooks beside this file, each in a folder of its own, and says how long each took. Use: check.py [NAME …]"""

import pathlib
import sys
import tempfile
import time

import nbformat
from nbclient import NotebookClient

folder = pathlib.Path(__file__).resolve().parent
named = [folder / f"{name}.ipynb" for name in sys.argv[1:]]
for path in named or sorted(folder.glob("*.ipynb")):
    notebook = nbformat.read(path, as_version=4)
    kept = [cell for cell in notebook.cells if cell.get("outputs")]
    assert not kept, f"{path.name} has outputs stored: clear them"
    with tempfile.TemporaryDirectory() as place:
        begin = time.monotonic()
        NotebookClient(notebook, timeout=1800, resources={"metadata": {"path": place}}).execute()
        print(f"{path.name}: {time.monotonic() - begin:.1f} s", flush=True)
