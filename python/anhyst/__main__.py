"""The command line: ``anhyst``, or ``python -m anhyst``."""

import signal
import sys

from . import _native


def main() -> int:
    """Does what the command line says; the exit status."""
    # Python's handler would only take notice of Ctrl-C and go on: here it ends whatever is no run, as it ends the executable.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.main(["anhyst", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
