"""Systems of python-control from the parts of this package: a hysteresis law as a discrete ``nlsys``, the rod as a state space.

>>> import anhyst, control
>>> from anhyst.control import initial_state, law_system
>>> law = anhyst.Law.bouc_wen(1e-5, 20.0)
>>> piezo = law_system(law, dt=1e-4)
>>> answer = control.input_output_response(piezo, T, voltage, X0=initial_state(law))
"""

from __future__ import annotations

from typing import Any

import control
import numpy as np

from . import _native

__all__ = ["initial_state", "law_system", "rod_system"]


def initial_state(law: _native.Law) -> np.ndarray:
    """Where a law is now, as the state of its system, shape (m,)."""
    return law.state_vector


def _part(of: Any, kind: type) -> Any:
    if not isinstance(of, kind):
        raise TypeError(f"an anhyst.{kind.__name__} is wanted, not {type(of).__name__}")
    return of


def law_system(law: _native.Law, dt: float, *, feedthrough: bool = True, name: str = "law") -> Any:
    """A law as a discrete system of one input and one output; its states are all that the law remembers.

    In each sample ``dt`` seconds pass at the input as it stood, then the input moves: ``y[k]`` is the output there, which is what
    ``law.run(u, dt)`` gives, to the bit. Without ``feedthrough`` ``y[k]`` is the output of the sample before, so that a loop around it
    is no algebraic one. The law itself is copied and not moved; what :func:`anhyst.fit_law` found will do as well.
    """
    own = _part(getattr(law, "law", law), _native.Law).copy()

    def update(_t, x, u, _parameters):
        own.state_vector = x
        own.step(float(u[0]), dt)
        return own.state_vector

    def output(_t, x, u, _parameters):
        own.state_vector = x
        return np.array([own.step(float(u[0]), dt) if feedthrough else own.output])

    return control.nlsys(
        update,
        output,
        inputs=["u"],
        outputs=["y"],
        states=len(own.state_vector),
        dt=dt,
        name=name,
    )


def rod_system(rod: _native.Rod, *, name: str = "rod") -> Any:
    """The rod as a continuous state space: from magnetization (A/m) and force on the tip (N) to displacement (m)."""
    _part(rod, _native.Rod)
    return control.ss(
        [[0.0, 1.0], [-rod.stiffness_per_s2, -rod.damping_per_s]],
        [[0.0, 0.0], [rod.gain, rod.force_gain_per_kg]],
        [[1.0, 0.0]],
        [[0.0, 0.0]],
        inputs=["magnetization_a_per_m", "force_n"],
        outputs=["displacement_m"],
        states=["displacement_m", "velocity_m_per_s"],
        name=name,
    )
