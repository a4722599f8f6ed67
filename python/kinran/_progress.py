"""A bar for work that takes long."""

import contextlib
import sys
import time

#: Work that is over sooner needs no bar, in seconds; chosen by eye.
PATIENCE = 1.0


@contextlib.contextmanager
def watched(progress):
    """Gives the callback of a task: what was asked for, or in a terminal or notebook a bar, or None."""
    if callable(progress):
        yield progress
        return
    is_shown = progress or (progress is None and (sys.stderr.isatty() or "ipykernel" in sys.modules))
    if not is_shown:
        yield None
        return
    started, drawn = time.monotonic(), False

    def draw(what, done, total):
        nonlocal drawn
        if time.monotonic() - started < PATIENCE:
            return
        share = f"{100 * done / total:3.0f} %" if total else "    "
        bar = "=" * int(20 * done / total) if total else ""
        print(f"\r{share} [{bar:20}] {what:.50}\x1b[K", end="", file=sys.stderr, flush=True)
        drawn = True

    try:
        yield draw
    finally:
        if drawn:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
