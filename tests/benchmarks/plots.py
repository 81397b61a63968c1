"""The plots of the page, as SVG; one style, and a palette that colour-blind people can tell apart (Okabe and Ito)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

COLOURS = {  # and markers
    "auto": ("#000000", "o"),
    "double": ("#999999", "P"),
    "single": ("#555555", "X"),
    "povray": ("#D55E00", "s"),
    "tachyon": ("#0072B2", "^"),
    "mitsuba": ("#009E73", "D"),
    "radiance": ("#CC79A7", "v"),
    "c++ double": ("#E69F00", "*"),
    "c++ float": ("#56B4E9", "h"),
}
STYLE = {
    "svg.hashsalt": "crossray",  # the same file for the same numbers
    "font.size": 11,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#dddddd",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "figure.facecolor": "white",
}
NEAR = 1.25  # a line that much above a bar is in the way of its number
Series = Mapping[str, Sequence[tuple[float, float]]]


def draw_lines(path: Path, series: Series, names: Mapping[str, str], *labels: str) -> None:
    """Points by contender joined by lines, on logarithmic axes; labels: the title, then of the axes."""
    with mpl.rc_context(STYLE):
        figure, axes = _figure(*labels)
        for name, points in series.items():
            if points:
                colour, marker = COLOURS[name]
                axes.plot(*zip(*points, strict=True), color=colour, marker=marker, label=names[name], linewidth=1.8)
        axes.set_xscale("log")
        across = sorted({x for points in series.values() for x, _ in points})
        axes.set_xticks(across, [f"{x:,.0f}" for x in across])
        axes.xaxis.set_minor_locator(NullLocator())
        _scale_up(axes)
        axes.legend(loc="center left", bbox_to_anchor=(1, 0.5))
        _save(figure, path)


def draw_bars(
    path: Path,
    groups: Mapping[str, Mapping[str, float]],
    names: Mapping[str, str],
    targets: Mapping[str, float],
    *labels: str,
) -> None:
    """A group of bars a scene, one for each contender, on a logarithmic axis; lines across the bars are targets."""
    contenders = [name for name in COLOURS if any(name in bars for bars in groups.values())]
    width = 0.85 / max(1, len(contenders))
    with mpl.rc_context(STYLE):
        figure, axes = _figure(*labels)
        for place, name in enumerate(contenders):
            xs = [index + (place - (len(contenders) - 1) / 2) * width for index in range(len(groups))]
            heights = [bars.get(name, float("nan")) for bars in groups.values()]
            axes.bar(xs, heights, width * 0.92, color=COLOURS[name][0], label=names[name])
            target = targets.get(name, 0.0)
            if target:
                axes.hlines([target] * len(xs), [x - width / 2 for x in xs], [x + width / 2 for x in xs], "black")
            for x, height in zip(xs, heights, strict=True):
                above = target if height <= target < NEAR * height else height  # the number is clear of the line
                if isfinite(height):
                    shown = f"{height:.0f}" if height >= 10 else f"{height:.1f}"
                    axes.annotate(shown, (x, above), (0, 2), textcoords="offset points", ha="center", fontsize=8)
        _scale_up(axes)
        axes.set_xticks(range(len(groups)), list(groups))
        axes.grid(False, axis="x")
        axes.axhline(1, color="black", linewidth=0.8)
        axes.legend(loc="center left", bbox_to_anchor=(1, 0.5))
        _save(figure, path)


def _figure(title: str, across: str, up: str) -> tuple[Figure, Any]:
    figure = Figure(figsize=(9, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.set(xlabel=across, ylabel=up)
    axes.set_title(title, loc="left", fontsize=12)
    return figure, axes


def _scale_up(axes: Any) -> None:
    """A logarithmic axis with plain numbers."""
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None, dpi=110)
