"""The command line: ``anhyst``, or ``python -m anhyst``."""

import os
import pathlib
import signal
import sys

from . import _native


def main() -> int:
    """Does what the command line says; the exit status."""
    # Python's handler would only take notice of Ctrl-C and go on: here it ends whatever is no run, as it ends the executable.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # What goes into an FMU lies beside the module.
    os.environ.setdefault("ANHYST_FMU_LIBRARY", str(pathlib.Path(__file__).with_name("libanhyst_fmu.so")))
    return _native.main(["anhyst", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
