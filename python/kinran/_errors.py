"""What Kinran raises."""

import json
import re

from . import _kinran


class KinranError(Exception):
    """Something went wrong.

    Attributes
    ----------
    code : str
        The kind of error, a word that does not change: ``io``, ``malformed``, ``unsupported``, ``input``, ``maps``,
        ``usage``, ``manifest``, ``internal`` and others; docs/json.md lists them.
    file : str or None
        The file or folder that it is about.
    option : str or None
        The option that it is about, as Python has it.
    line, column : int or None
        Where in a text, from 1.
    """

    code = "internal"
    file = option = line = column = None


class InputError(KinranError, ValueError):
    """A file, a folder or an option is not what it should be; the message says what to do about it."""


class FileError(InputError, OSError):
    """A file could not be read or written."""

    @classmethod
    def of(cls, name, error):
        """The exception for a file that Python could not read."""
        wrong = cls(f"{name}: {error.strerror}")
        wrong.code, wrong.file = "io", name
        return wrong

    def __str__(self):
        # OSError makes a pair of numbers and words of what it is given.
        return str(self.args[0])


class Cancelled(KinranError):
    """The work was stopped."""


def _switches():
    commands = (["bake"], ["detail", "solve"], ["skin-lut"])
    flags = [flag for words in commands for flag in json.loads(_kinran.options(words))]
    return {flag["name"] for flag in flags if flag["switch"]}


def in_python(message):
    """A message with its flags as options: ``--y-down`` becomes ``y_down=True``, ``--zstd 9`` becomes ``zstd="9"``."""
    switches = _switches()

    def option(match):
        name, value = match[1], match[2]
        python = name.replace("-", "_")
        if name in switches:
            return f"{python}=True" + (f" {value}" if value else "")
        if value and (value.isupper() or "=" in value or re.fullmatch(r"[\d.]+(\.\.1)?|on|off", value)):
            return f'{python}="{value}"'
        return python + (f" {value}" if value else "")

    message = re.sub(r"(?<![\w-])--([a-z][a-z-]*)(?:[ =]([\w./=-]+))?", option, message)
    # How the command line calls a value says nothing here.
    return re.sub(r"'(\w+) <[^>]*>'", r"`\1`", message)


def of(text):
    """The exception for a failure, which is what ``kinran --json`` prints as ``error``."""
    failure = json.loads(text)
    code = failure.get("code", "internal")
    if code == "cancelled":
        kind = Cancelled
    elif code == "io":
        kind = FileError
    elif failure.get("exit_code") == 2:
        kind = InputError
    else:
        kind = KinranError
    error = kind(in_python(failure.get("message", "")))
    error.code = code
    error.file = failure.get("file")
    flag = failure.get("flag")
    error.option = flag.split()[0].lstrip("-").replace("-", "_") if flag else None
    error.line, error.column = failure.get("line"), failure.get("column")
    return error
