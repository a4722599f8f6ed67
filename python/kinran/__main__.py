"""The command line: ``python -m kinran`` is ``kinran``."""

import signal
import sys

from . import _kinran


def main():
    """Does what the words of the command line say, and ends with the program's exit code."""
    # Python would only note Ctrl-C until Rust gives back control.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stdout.flush()
    sys.exit(_kinran.command(["kinran", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
