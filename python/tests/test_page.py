"""The page in the docs does what it says."""

import pathlib
import re
import subprocess
import sys

PAGE = pathlib.Path(__file__).parents[2] / "docs" / "python.md"


def test_the_first_result_comes_out_as_the_page_has_it(tmp_path):
    (program,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    assert len(program.strip().splitlines()) <= 30
    said = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    first, second = said.stdout.splitlines()
    numbers = [float(n) for n in re.findall(r"[\d.]+", first)]
    # Along the strokes it is as rough as it was; across, waves of slope 0.4 add to it.
    assert 0.08 < numbers[1] < 0.12 and 0.25 < numbers[0] < 0.6, first
    assert second == "BC7 []"


def test_what_the_page_names_is_there():
    import kinran

    rows = PAGE.read_text().split("## What there is")[1].split("\n\n")[1].splitlines()[2:]
    names = [name for row in rows for name in re.findall(r"`(\w+)[(.`]", row.split("|")[1])]
    assert len(names) > 12
    for name in names:
        assert hasattr(kinran, name), name
