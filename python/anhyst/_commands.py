"""The commands as functions. What they return has the content of the JSON that they write."""

from __future__ import annotations

import json
import os
from pathlib import Path as _Path
from typing import Any, Iterable, Sequence, Union

from . import _native
from ._run import Scenario, done, known, new_folder
from ._words import Path, Settings, settings, span, words

Spans = Union[str, "tuple[int | None, int | None]"]
Files = Union[Path, "Sequence[Path]"]


class Result:
    """What a command found: the content of its JSON as attributes and items, and the folder with its files."""

    def __init__(self, report: dict[str, Any], folder: _Path):
        self.report = report
        """The content of the JSON file."""
        self.folder = folder
        """Where the command wrote its results."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["report"][name]
        except KeyError:
            raise AttributeError(f"there is no {name!r} here; there are {', '.join(self.__dict__.get('report', ()))}") from None

    def __getitem__(self, name: str) -> Any:
        return known(self.report, name)

    def __dir__(self):
        return [*super().__dir__(), *self.report]

    def file(self, name: str) -> _Path:
        """One of its files: ``law.ron``, ``fit.svg``, ``report.html``, …"""
        path = self.folder / name
        if not path.exists():
            there = ", ".join(sorted(own.name for own in self.folder.iterdir()))
            raise FileNotFoundError(f"{path} is not there; there are {there}")
        return path

    def _repr_svg_(self) -> str | None:
        """The picture, in a notebook."""
        drawn = sorted(self.folder.glob("*.svg"))
        return drawn[0].read_text() if drawn else None

    def __repr__(self) -> str:
        return f"<anhyst result in {self.folder}: {', '.join(self.report)}>"


def _measured(data: Any, folder: _Path) -> list[str]:
    """Files as they are; a table (a mapping of columns, a pandas frame) is written beside the results, every number to its last bit."""
    if isinstance(data, (str, os.PathLike)):
        return [os.fspath(data)]
    if isinstance(data, (list, tuple)):
        return [path for own in data for path in _measured(own, folder)]
    if not hasattr(data, "keys"):
        raise TypeError(f"the data must be a file's path or a table of named columns, not {type(data).__name__}")
    of = {name: data[name] for name in data.keys()}
    # A frame over its time has it as the index.
    index = getattr(data, "index", None)
    if getattr(index, "name", None) is not None and index.name not in of:
        of = {index.name: index, **of}
    names = list(of)
    columns = [own.tolist() if hasattr(own, "tolist") else list(own) for own in of.values()]
    lengths = {len(column) for column in columns}
    if len(lengths) != 1:
        told = ", ".join(f"{name} {len(column)}" for name, column in zip(names, columns))
        raise _native.BadInput(f"the columns must be as long as each other: {told}")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"data-{len(list(folder.glob('data-*.csv')))}.csv"
    with open(path, "w") as file:
        file.write(",".join(map(str, names)) + "\n")
        file.writelines(",".join(map(repr_of, row)) + "\n" for row in zip(*columns))
    return [os.fspath(path)]


def _must_be_path(model: Any) -> None:
    if not isinstance(model, (str, os.PathLike)):
        saved = ": save it, and give its file" if hasattr(model, "save") else ""
        raise TypeError(f"the model must be a file's path, not {type(model).__name__}{saved}")


def repr_of(number: Any) -> str:
    """Shortest text that gives the same bits."""
    if number is None or isinstance(number, str):
        return number or ""
    return number.isoformat() if hasattr(number, "isoformat") else repr(number)


def _table(column: Any, rows: Any, drop_rows: Any) -> list[str]:
    columns = [f"{name}={header}" for name, header in column.items()] if isinstance(column, dict) else column
    drop = [drop_rows] if isinstance(drop_rows, (str, tuple)) else drop_rows or []
    return words(column=columns, rows=span(rows), drop_rows=[span(own) for own in drop])


def check(scenario: Path | Scenario, *, set: Settings = None) -> Scenario:
    """Reads, changes and checks a scenario without running it."""
    return Scenario(scenario.path, [*scenario.settings, *settings(set)]) if isinstance(scenario, Scenario) else Scenario(scenario, set)


def fit(
    data: Any,
    *,
    law: str | None = None,
    output: str | None = None,
    name: str | None = None,
    fix: dict[str, float] | None = None,
    curve: str | None = None,
    column: Any = None,
    rows: Spans | None = None,
    drop_rows: Any = None,
    threads: int | None = None,
    out: Path | None = None,
) -> Result:
    """Fits a material to measured loops, or with ``law`` any hysteresis law to any input and output, as ``anhyst fit``.

    ``data`` is a file, or a table of columns named with their units (``{"voltage_V": …, "displacement_um": …}``, a pandas frame).
    The report is that of ``fit.json``; ``material.ron`` or ``law.ron`` lie in the result's folder.
    """
    folder = new_folder(out, "fit")
    (path,) = _measured(data, folder)
    held = [f"{symbol}={own!r}" for symbol, own in (fix or {}).items()]
    told = words(law=law, output=output, name=name, fix=held, curve=curve, threads=threads, out=folder, json=True)
    return _result(["fit", f"--data={path}", *told, *_table(column, rows, drop_rows)], folder)


def predict(
    model: Path,
    data: Any,
    *,
    column: Any = None,
    rows: Spans | None = None,
    drop_rows: Any = None,
    out: Path | None = None,
) -> Result:
    """Runs a model freely along a measured file, as ``anhyst predict``; ``predict.csv`` in the folder has what it gives."""
    _must_be_path(model)
    folder = new_folder(out, "predict")
    (path,) = _measured(data, folder)
    told = words(model=model, data=path, out=folder, json=True)
    return _result(["predict", *told, *_table(column, rows, drop_rows)], folder)


def estimate(
    model: Path,
    data: Any,
    *,
    law: str | None = None,
    parameters: Iterable[str] | None = None,
    range_a_per_m: tuple[float, float] | None = None,
    start_a_per_m: float | None = None,
    drift_variance_per_s: float | None = None,
    settle_s: float | None = None,
    column: Any = None,
    rows: Spans | None = None,
    drop_rows: Any = None,
    threads: int | None = None,
    out: Path | None = None,
) -> Result:
    """Estimates a model's parameters from a measured run, as ``anhyst estimate``: ``result.parameters["a"]["value"]``."""
    _must_be_path(model)
    folder = new_folder(out, "estimate")
    (path,) = _measured(data, folder)
    told = words(
        model=model,
        data=path,
        law=law,
        parameters=None if parameters is None else ",".join([parameters] if isinstance(parameters, str) else parameters),
        range_a_per_m=span(range_a_per_m),
        start_a_per_m=start_a_per_m,
        drift_variance_per_s=drift_variance_per_s,
        settle_s=settle_s,
        threads=threads,
        out=folder,
        json=True,
    )
    return _result(["estimate", *told, *_table(column, rows, drop_rows)], folder)


def diagnose(
    model: Path,
    data: Any,
    *,
    fitted_model: bool = False,
    control: Path | None = None,
    settle_s: float | None = None,
    column: Any = None,
    rows: Spans | None = None,
    drop_rows: Any = None,
    threads: int | None = None,
    out: Path | None = None,
) -> Result:
    """Finds what a model lacks on measured runs, names it and adds it, as ``anhyst diagnose``.

    ``data`` is a file or a table, or a list of them that are explained together. ``amended.ron`` and ``report.html`` lie in the
    result's folder. It takes minutes; Ctrl-C ends it.
    """
    _must_be_path(model)
    folder = new_folder(out, "diagnose")
    told = words(
        model=model,
        data=_measured(data, folder),
        fitted_model=fitted_model,
        control=control,
        settle_s=settle_s,
        threads=threads,
        out=folder,
        json=True,
    )
    return _result(["diagnose", *told, *_table(column, rows, drop_rows)], folder)


def _result(command: list[str], folder: _Path) -> Result:
    return Result(json.loads(done(command, folder)), folder)
