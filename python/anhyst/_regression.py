"""A hysteresis law as an estimator of scikit-learn."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._laws import FittedLaw, fit_law

try:
    from sklearn.base import BaseEstimator, RegressorMixin
except ImportError:  # Without scikit-learn it is the same class, but none of theirs.

    class BaseEstimator:  # type: ignore[no-redef]
        """What scikit-learn asks of parameters."""

        def get_params(self, deep: bool = True) -> dict[str, Any]:
            """The parameters of the constructor."""
            return {name: getattr(self, name) for name in ("law", "dt", "input", "output", "threads")}

        def set_params(self, **parameters: Any):
            """Sets parameters of the constructor."""
            for name, own in parameters.items():
                if name not in self.get_params():
                    raise ValueError(f"there is no parameter {name!r}; there are {', '.join(self.get_params())}")
                setattr(self, name, own)
            return self

    class RegressorMixin:  # type: ignore[no-redef]
        """The score of a regression."""

        def score(self, X: Any, y: Any) -> float:
            """R²: 1 less the squares of what is left over those about the mean."""
            measured = np.asarray(y, dtype=float)
            left = measured - self.predict(X)  # type: ignore[attr-defined]
            return 1.0 - float(left @ left) / float(np.sum((measured - measured.mean()) ** 2))


class HysteresisRegressor(RegressorMixin, BaseEstimator):
    """``HysteresisRegressor(law="auto").fit(x, y).predict(x)``: an output with memory, over one input.

    Rows are samples in the order in which they were measured: a shuffled split cuts a history to pieces, so split by blocks
    (``TimeSeriesSplit``, ``cross_val_score(..., cv=KFold(shuffle=False))``). ``x`` is of shape (n,) or (n, 1), ``y`` of shape (n,).

    Parameters
    ----------
    law : str
        One of :func:`anhyst.law_names`, or ``"auto"``.
    dt : float or None
        Time between two rows, s, for laws with creep; None: a sweep.
    input, output : str
        The quantities, as of :func:`anhyst.fit_law`. They name, and change no number.
    threads : int
        0: one a core.

    Attributes
    ----------
    fitted_ : FittedLaw
    law_ : Law
        At rest.
    n_features_in_ : int
    """

    def __init__(
        self,
        law: str = "auto",
        dt: float | None = None,
        input: str = "voltage",
        output: str = "displacement",
        threads: int = 0,
    ):
        self.law = law
        self.dt = dt
        self.input = input
        self.output = output
        self.threads = threads

    def fit(self, X: Any, y: Any) -> "HysteresisRegressor":
        """Fits the law to a record that begins as the fit assumes (``fitted_.report["start"]``)."""
        inputs, outputs = _column(X), np.asarray(y, dtype=float)
        self.fitted_: FittedLaw = fit_law(
            inputs, outputs, self.dt, law=self.law, input=self.input, output=self.output, threads=self.threads
        )
        self.law_ = self.fitted_.law
        self.n_features_in_ = 1
        return self

    def predict(self, X: Any) -> np.ndarray:
        """A free run along ``X`` that begins as the fit assumed, shape (n,)."""
        if not hasattr(self, "fitted_"):
            raise _not_fitted()
        return self.fitted_.predict(_column(X), self.dt)


def _not_fitted() -> Exception:
    try:
        from sklearn.exceptions import NotFittedError as error
    except ImportError:
        error = ValueError
    return error("this HysteresisRegressor is not fitted yet: call fit first")


def _column(of: Any) -> np.ndarray:
    column = np.asarray(of, dtype=float)
    if column.ndim == 2 and column.shape[1] == 1:
        column = column[:, 0]
    if column.ndim != 1:
        raise ValueError(f"X has shape {column.shape}; a law has one input: it must be (n,) or (n, 1)")
    return np.ascontiguousarray(column)
