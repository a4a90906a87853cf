"""Scenarios and what comes of them."""

from __future__ import annotations

import json
import os
from pathlib import Path as _Path
from typing import TYPE_CHECKING, Any, Iterator, Mapping

import numpy as np

from . import _native
from ._words import Path, Settings, settings, words

if TYPE_CHECKING:
    import pandas
    import pyarrow


class Scenario(_native.Scenario):
    """A run before it is run: a file, changed by ``set`` and checked. ``ron`` is the whole, with every default."""

    def __new__(cls, path: Path, set: Settings = None):
        return super().__new__(cls, path, settings(set))

    def set(self, **changes: Any) -> "Scenario":
        """The same with more changes. Dots in a path are double underscores: ``controller__feedback__kp=0.5``."""
        more = {path.replace("__", "."): own for path, own in changes.items()}
        return Scenario(self.path, [*self.settings, *settings(more)])

    def run(self, **options: Any) -> "Run":
        """As :func:`anhyst.run`."""
        return run(self, **options)


class Tokens(Mapping):
    """All tokens of a run by channel and field: ``tokens["measurement"]["displacement_m"]`` is an array of shape (ticks,).

    A channel is a dict of float64 arrays that own what was read: :meth:`table` gives them to Arrow without a copy.
    """

    def __init__(self, tick_s: float, channels: dict[str, dict[str, np.ndarray]], scenario: Scenario):
        self.tick_s = tick_s
        """Length of a tick, s."""
        self._channels = channels
        self._scenario = scenario

    def __getitem__(self, channel: str) -> dict[str, np.ndarray]:
        return known(self._channels, channel)

    def __iter__(self) -> Iterator[str]:
        return iter(self._channels)

    def __len__(self) -> int:
        return len(self._channels)

    def time_s(self, channel: str = "measurement") -> np.ndarray:
        """The instants of a channel's tokens, s, shape (ticks,)."""
        own = self[channel]
        ticks = own.get("tick")
        return (np.arange(len(next(iter(own.values())))) if ticks is None else ticks) * self.tick_s

    def table(self, channel: str = "measurement") -> "pyarrow.Table":
        """A channel as an Arrow table, with units in the fields' metadata; its buffers are the arrays themselves."""
        import pyarrow as pa

        unit_of = self._scenario.unit_of
        units = {name: unit_of(name, unit) for of, name, unit, _ in _native.fields() if of == channel}
        columns = self[channel]
        about = [pa.field(name, pa.from_numpy_dtype(own.dtype), metadata={"unit": units.get(name, "")}) for name, own in columns.items()]
        return pa.Table.from_arrays([pa.array(own) for own in columns.values()], schema=pa.schema(about))

    def frame(self, channel: str = "measurement") -> "pandas.DataFrame":
        """A channel as a pandas frame over the time in s. pandas puts columns of one type side by side: that is a copy."""
        import pandas as pd

        columns = {name: own for name, own in self[channel].items() if name != "tick"}
        return pd.DataFrame(columns, index=pd.Index(self.time_s(channel), name="time_s"))

    def __repr__(self) -> str:
        told = ", ".join(f"{channel} {len(next(iter(own.values())))}" for channel, own in self._channels.items())
        return f"<anhyst.Tokens: {told}>"


class Run:
    """A run that was made: its folder, its summary, its tokens."""

    def __init__(self, folder: Path):
        self.folder = _Path(folder)
        """With ``summary.json``, ``report.html``, ``scenario.ron``, ``recording.rrd``."""
        path = self.folder / "summary.json"
        try:
            self.summary: dict[str, Any] = json.loads(path.read_text())
        except OSError as cause:
            raise _native.BadInput(f"{path} cannot be read: {cause.strerror}") from None
        self._tokens: Tokens | None = None

    @property
    def held(self) -> bool:
        """Whether what the scenario expects held; False, too, where it states no tolerance."""
        return self.summary["held"]

    @property
    def failures(self) -> list[str]:
        """What did not hold."""
        return self.summary["failures"]

    @property
    def digest(self) -> str:
        """Digest of all tokens of all nodes."""
        return self.summary["digest"]

    @property
    def error_rms_m(self) -> float:
        """Of the tracking, after settling, m."""
        return self.summary["error_rms_m"]

    @property
    def error_max_m(self) -> float:
        """The same at its largest, m."""
        return self.summary["error_max_m"]

    @property
    def report(self) -> _Path:
        """The page of the run, to look at."""
        return self.folder / "report.html"

    @property
    def scenario(self) -> Scenario:
        """As it was run, with every default."""
        return Scenario(self.folder / "scenario.ron")

    @property
    def tokens(self) -> Tokens:
        """Every token of the recording, bit for bit; read once."""
        if self._tokens is None:
            # A ring leaves out parts, the first one as well.
            recordings = sorted(self.folder.glob("recording*.rrd"), key=_number)
            if not recordings:
                raise _native.BadInput(f"{self.folder / 'recording.rrd'} is not there: the run was made without a recording")
            tick_s, channels = _native.read_tokens(recordings)
            self._tokens = Tokens(tick_s, channels, self.scenario)
        return self._tokens

    def export(self, out: Path | None = None) -> tuple[_Path, _Path]:
        """Writes what was measured as a table and what the controller's side believes as a model: ``run.csv`` and ``model.ron``, as
        :func:`anhyst.diagnose` and :func:`anhyst.estimate` take them, into ``out`` or the run's own folder."""
        into = self.folder if out is None else _Path(out)
        _native.command(["export", str(self.folder), f"--out={into}"])
        return into / "run.csv", into / "model.ron"

    def plot(self, axes: Any = None, *, from_s: float | None = None, to_s: float | None = None) -> Any:
        """Reference and displacement, above the last 0.1 s or what lies between the instants, and the error, below, of the whole run;
        by matplotlib, on two axes of one's own or new ones. The figure."""
        import matplotlib.pyplot as plt

        tokens, metres = self.tokens, self.scenario.units[1] == "m"
        time_s = tokens.time_s("demand")
        begin = time_s[-1] - 0.1 if from_s is None and to_s is None else from_s or 0.0
        shown = slice(np.searchsorted(time_s, begin), None if to_s is None else np.searchsorted(time_s, to_s))
        if not len(time_s[shown]):
            end = "" if to_s is None else f" to {to_s} s"
            raise _native.BadInput(f"nothing of the run lies from {begin} s{end}: it goes from {time_s[0]} to {time_s[-1]} s")
        (scale, unit), (small, small_unit) = ((1e6, "µm"), (1e9, "nm")) if metres else 2 * [(1.0, self.scenario.units[1])]
        above, below = plt.subplots(2, 1, figsize=(8, 5), layout="constrained")[1] if axes is None else axes
        reference, moved = tokens["demand"]["reference_m"], tokens["truth"]["displacement_m"]
        above.plot(time_s[shown], scale * reference[shown], label="reference")
        above.plot(time_s[shown], scale * moved[shown], "--", label="displacement")
        above.set(xlabel="time, s", ylabel=unit)
        above.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False)
        below.plot(time_s, small * (reference - moved), linewidth=0.5)
        below.set(xlabel="time, s", ylabel=f"error, {small_unit}")
        return above.figure

    def __repr__(self) -> str:
        verdict = "held" if self.held else "not held"
        return f"<anhyst.Run {self.summary['scenario']}: {verdict}, error rms {1e9 * self.error_rms_m:.1f} nm, {self.folder}>"


def run(
    scenario: Path | Scenario,
    *,
    set: Settings = None,
    out: Path | None = None,
    embedded: bool = True,
    recording: bool = True,
) -> Run:
    """Runs a scenario from start to verdict, as ``anhyst run``.

    ``scenario`` is a file, ``"built-in/milling.ron"``, or a :class:`Scenario`. ``set`` changes values in it:
    ``{"controller.feedback.kp": 0.5}``, a text standing for itself as RON. ``embedded`` runs all nodes in this process; False starts
    them as processes of their own. The bits are the same. Without ``recording`` there are no tokens afterwards.

    Ctrl-C ends the run and raises ``KeyboardInterrupt``.
    """
    changes = settings(set)
    if isinstance(scenario, Scenario):
        path: Path = scenario.path
        changes = [*scenario.settings, *changes]
    else:
        path = scenario
    folder = new_folder(out, _Path(path).stem)
    asked = words(set=changes, out=folder, embedded=embedded, no_recording=not recording, json=True)
    done(["run", os.fspath(path), *asked], folder)
    return Run(folder)


def known(of: Mapping[str, Any], name: str) -> Any:
    """What has this name; else a sentence with the names that there are."""
    if name not in of:
        raise KeyError(f"there is no {name!r} here; there are {', '.join(of)}")
    return of[name]


def new_folder(out: Path | None, name: str) -> _Path:
    """Where results go: what is named, or as of the command line a new folder under runs/."""
    return _native.new_folder(name) if out is None else _Path(out)


def done(command: list[str], folder: _Path) -> str:
    """What a command would have printed. One that is refused leaves no empty folder."""
    try:
        return _native.command(command)[1]
    except BaseException:
        if folder.parent == _Path("runs") and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
        raise


def _number(recording: _Path) -> int:
    return int(recording.stem.rpartition("-")[2]) if "-" in recording.stem else 1
