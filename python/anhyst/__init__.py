"""Control of actuators with hysteresis: the command line ``anhyst`` as functions, and its parts to build with.

Whole tasks, each the command of that name with the same bits, the same files and the same refusals:
:func:`run`, :func:`check`, :func:`fit`, :func:`predict`, :func:`estimate`, :func:`diagnose`.

Parts, over NumPy arrays: :class:`Law` (any hysteresis law), :func:`fit_law`, :class:`Material`, :class:`Anhysteretic`,
:class:`Bank`, :class:`Rod`, :class:`Actuator`; :class:`Loop`, :class:`Plant`, :class:`Controller` and :class:`Estimator` of a
:class:`Scenario`. :mod:`anhyst.control` makes systems of python-control, :class:`HysteresisRegressor` follows scikit-learn.

SI units throughout; where a number has a unit, its name ends with it. Input that cannot be used raises :class:`BadInput`, a
``ValueError``, with the sentence of the command line; a process that fails :class:`ProcessFailed`.
"""

import sys as _sys
from typing import TYPE_CHECKING

from . import _native
from ._native import (
    Actuator,
    Anhysteretic,
    BadInput,
    Bank,
    Controller,
    Estimator,
    Law,
    LawState,
    Loop,
    Material,
    Plant,
    ProcessFailed,
    Rod,
    __version__,
    law_names,
)

if TYPE_CHECKING:
    from ._commands import Result, check, diagnose, estimate, fit, predict
    from ._laws import FittedLaw, fit_law
    from ._regression import HysteresisRegressor
    from ._run import Run, Scenario, Tokens, run

# What needs NumPy is imported when it is first asked for: the processes of a run, which import this, need none.
_LATER = {
    "_commands": ("Result", "check", "diagnose", "estimate", "fit", "predict"),
    "_laws": ("FittedLaw", "fit_law"),
    "_regression": ("HysteresisRegressor",),
    "_run": ("Run", "Scenario", "Tokens", "run"),
}
_WHERE = {name: module for module, names in _LATER.items() for name in names}

__all__ = [
    "Actuator",
    "Anhysteretic",
    "BadInput",
    "Bank",
    "Controller",
    "Estimator",
    "FittedLaw",
    "HysteresisRegressor",
    "Law",
    "LawState",
    "Loop",
    "Material",
    "Plant",
    "ProcessFailed",
    "Result",
    "Rod",
    "Run",
    "Scenario",
    "Tokens",
    "__version__",
    "check",
    "diagnose",
    "estimate",
    "fit",
    "fit_law",
    "law_names",
    "predict",
    "run",
]

# How a process of a run is started; the folder that one is in is not where its modules are sought.
_native.tell_command(
    [
        _sys.executable,
        "-c",
        "import sys; sys.path.pop(0); from anhyst import _native; sys.exit(_native.main(['anhyst', *sys.argv[1:]]))",
    ]
)


def __getattr__(name: str):
    from importlib import import_module

    if name in _WHERE:
        return getattr(import_module("." + _WHERE[name], __name__), name)
    if name == "control":
        return import_module(".control", __name__)
    raise AttributeError(f"module 'anhyst' has no attribute {name!r}")


def __dir__():
    return sorted(__all__)
