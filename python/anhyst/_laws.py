"""A fit of hysteresis laws to arrays."""

from __future__ import annotations

import json
from typing import Any, Sequence

import numpy as np

from . import _native
from ._words import Path


def _time(x: Any, time_s: Any) -> Any:
    """Instants, of which a number is the distance."""
    return np.arange(len(x)) * float(time_s) if time_s is not None and np.ndim(time_s) == 0 else time_s


class FittedLaw:
    """What a fit found: ``law`` (at rest), ``report`` (the content of ``fit.json``), ``modelled`` (what it makes of each record), ``ron``."""

    def __init__(self, ron: str, report: dict[str, Any], law: _native.Law, modelled: list[np.ndarray]):
        self.ron = ron
        """As a file that :func:`anhyst.predict`, scenarios and ``anhyst diagnose`` take: see :meth:`save`."""
        self.report = report
        """The content of ``fit.json``."""
        self.law = law
        """At rest."""
        self.modelled = modelled
        """What it makes of each record, freely run, shape (n,) each."""

    @property
    def name(self) -> str:
        """Which law it is."""
        return self.report["law"]

    @property
    def nrmse(self) -> float:
        """rms of what is left, over the output's range."""
        return self.report["nrmse"]

    @property
    def held_out_nrmse(self) -> float:
        """The same of data that were kept back."""
        return self.report["held_out_nrmse"]

    def predict(self, x: Any, time_s: Any = None) -> np.ndarray:
        """A free run along a record of the input, shape (n,), that begins as the fit assumed: ``report["start"]``."""
        (modelled,) = _native.predict_law(self.ron, [(x, _time(x, time_s))])
        return modelled

    def save(self, path: Path) -> None:
        """Writes ``law.ron``."""
        with open(path, "w") as file:
            file.write(self.ron)

    def __repr__(self) -> str:
        return f"<anhyst.FittedLaw {self.name}: {100 * self.nrmse:.3f} % left, {100 * self.held_out_nrmse:.3f} % of what was kept back>"


def fit_law(
    x: Any,
    y: Any,
    time_s: Any = None,
    *,
    law: str = "auto",
    input: str = "voltage",
    output: str = "displacement",
    threads: int = 0,
) -> FittedLaw:
    """Fits a hysteresis law to arrays, as ``anhyst fit --law`` does to a file.

    ``x`` and ``y`` are of shape (n,), or lists of such for several records; ``time_s`` the same, or None for a sweep, or a number: the
    time between two samples. ``law`` is one of :func:`anhyst.law_names`, or ``"auto"``: the one that predicts best of what is kept
    back. ``input`` and ``output`` name the quantities (``voltage``, ``current``, ``field``; ``displacement``, ``magnetization``,
    ``flux``, ``strain``), of which the numbers are in SI units.
    """
    several = isinstance(x, (list, tuple)) and len(x) > 0 and np.ndim(x[0]) == 1
    inputs: Sequence[Any] = x if several else [x]
    outputs: Sequence[Any] = y if several else [y]
    if len(inputs) != len(outputs):
        raise _native.BadInput(f"there are {len(inputs)} records of the input and {len(outputs)} of the output: they must be as many")
    times = time_s if several and isinstance(time_s, (list, tuple)) else [time_s] * len(inputs)
    records = [(own, out, _time(own, at)) for own, out, at in zip(inputs, outputs, times)]
    ron, report, model, modelled = _native.fit_law(records, law, input, output, threads)
    return FittedLaw(ron, json.loads(report), _native.Law.from_json(model), modelled)
