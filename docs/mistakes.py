"""Write docs/mistakes.md, the catalogue of mistakes that `crossray grade` knows: `make docs`."""

from __future__ import annotations

from pathlib import Path

from reference.mistakes import FAMILIES, MISTAKES

PAGE = Path(__file__).with_name("mistakes.md")

INTRODUCTION = """\
# The mistakes that crossray knows

Each is the document's model with a step replaced (`reference/mistakes.py`), which draws the picture that a program with
this mistake makes. `crossray grade` holds somebody's picture against all of them, and against two at once. Variants of
a mistake share its name. R11, a depth that never grows, has no picture: such a program never ends.

| | mistake | looks like | what to do | shown by |
|---|---|---|---|---|
"""

NUMBERS = """
## Numbers that are found

Where none of these explains a picture, the numbers below are searched, and the place of the light: "the ambient
coefficient is 0.2, not 0.1".

| | number | between |
|---|---|---|
"""


def page() -> str:
    """The text of docs/mistakes.md."""
    rows = []
    for key, mistake in MISTAKES.items():
        name = mistake.revealed_by
        place = f"../scenes/{'' if name.startswith('example') else 'diagnostic/'}{name}.txt"
        cells = (key.partition("/")[0], mistake.title, mistake.looks, mistake.hint, f"[{name}]({place})")
        rows.append(f"| {' | '.join(cells).replace('|n.l|', 'abs(n.l)')} |\n")
    numbers = [
        f"| {id_} | {family.title.rstrip(',')} | {family.bounds[0]:g} and {family.bounds[1]:g}{family.unit} |\n"
        for id_, family in FAMILIES.items()
    ]
    return INTRODUCTION + "".join(rows) + NUMBERS + "".join(numbers)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
