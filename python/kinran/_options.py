"""Options of functions, made of the flags of the command line: names, defaults and texts are the same for both."""

import difflib
import inspect
import json
import os
import textwrap

from . import _kinran
from ._errors import in_python


class Options:
    """The flags of a command; ``also`` are parameters that the function has besides."""

    def __init__(self, *words, without=()):
        flags = json.loads(_kinran.options(list(words)))
        self.flags = {f["name"].replace("-", "_"): f for f in flags if f["name"].replace("-", "_") not in without}

    def words(self, function, given):
        """What a person would type for keyword arguments; those that are None are left out."""
        words = []
        for name, value in given.items():
            flag = self.flags.get(name)
            if flag is None:
                near = difflib.get_close_matches(name, self.flags, 1)
                hint = f"; did you mean {near[0]}?" if near else ""
                raise TypeError(f"{function}() got an unexpected keyword argument '{name}'{hint}")
            if value is None:
                continue
            long = "--" + flag["name"]
            if flag["switch"]:
                if not isinstance(value, bool):
                    raise TypeError(f"{function}(): {name} is True or False, not {value!r}")
                words += [long] if value else []
            elif flag["many"]:
                pairs = value.items() if isinstance(value, dict) else value
                if isinstance(pairs, (str, bytes, os.PathLike)):
                    pairs = [pairs]
                for one in pairs:
                    word = f"{_word(one[0])}={_word(one[1])}" if isinstance(one, tuple) else _word(one)
                    words.append(f"{long}={word}")
            elif isinstance(value, (list, tuple)):
                words.append(f"{long}={','.join(_word(one) for one in value)}")
            else:
                words.append(f"{long}={_word(value)}")
        return words

    def describe(self, function):
        """Gives a function that ends with ``**options`` its signature and, in its docstring, the options."""
        own = list(inspect.signature(function).parameters.values())[:-1]
        keyword = inspect.Parameter.KEYWORD_ONLY
        extra = [inspect.Parameter(name, keyword, default=self._default(flag)) for name, flag in self.flags.items()]
        function.__signature__ = inspect.Signature(own + extra)
        lines = []
        for name, flag in self.flags.items():
            kind = "bool" if flag["switch"] else " or ".join(repr(v) for v in flag["values"]) or "str or number"
            if flag["many"]:
                kind = "list, or a dict of pairs"
            default = self._default(flag)
            lines.append(f"{name} : {kind}" + ("" if default is None else f", default {default!r}"))
            text = in_python(" ".join(flag["help"].split()))
            lines += textwrap.wrap(text, 76, initial_indent="    ", subsequent_indent="    ")
        doc = inspect.cleandoc(function.__doc__ or "")
        function.__doc__ = doc.replace("{options}", "\n".join(lines))
        return function

    @staticmethod
    def _default(flag):
        return False if flag["switch"] else flag["default"]


def _word(value):
    if isinstance(value, bool):
        return "on" if value else "off"
    return os.fspath(value) if isinstance(value, os.PathLike) else str(value)
