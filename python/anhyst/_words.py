"""Keywords of Python as words of the command line."""

from __future__ import annotations

import os
from typing import Any, Iterable, Mapping, Union

Path = Union[str, "os.PathLike[str]"]
Settings = Union[Mapping[str, Any], Iterable[str], str, None]


def value(of: Any) -> str:
    """A value as RON: numbers and truth values as they are, a text as it stands."""
    if isinstance(of, bool):
        return "true" if of else "false"
    if isinstance(of, (list, tuple)):
        opening, closing = "[]" if isinstance(of, list) else "()"
        return opening + ", ".join(value(own) for own in of) + closing
    if isinstance(of, str):
        return of
    if isinstance(of, int) or not hasattr(of, "__float__"):
        return str(of)
    return repr(float(of))


def settings(changes: Settings) -> list[str]:
    """``{"controller.feedback.kp": 0.5}`` or ``["controller.feedback.kp=0.5"]`` as ``path=value``."""
    if changes is None:
        return []
    if isinstance(changes, Mapping):
        return [f"{path}={value(own)}" for path, own in changes.items()]
    return [changes] if isinstance(changes, str) else list(changes)


def words(**options: Any) -> list[str]:
    """``settle_s=0.1`` as ``--settle-s 0.1``; a list repeats its option, None and False leave it out."""
    told: list[str] = []
    for name, given in options.items():
        option = "--" + name.replace("_", "-")
        if given is None or given is False:
            continue
        if given is True:
            told.append(option)
            continue
        for own in given if isinstance(given, (list, tuple)) else [given]:
            # One word, so that a value that begins with a dash is a value.
            told.append(f"{option}={os.fspath(own) if isinstance(own, os.PathLike) else own}")
    return told


def span(of: Any) -> str | None:
    """``(6300, 7300)`` as ``6300..7300``; either end may be None."""
    if of is None or isinstance(of, str):
        return of
    start, end = of
    return f"{'' if start is None else start}..{'' if end is None else end}"
