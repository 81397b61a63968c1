"""Which renderers there are: the modules in `translator/renderers`, and those that other distributions offer.

Such a distribution names its module in its `pyproject.toml`, and crossray finds it once it is installed:

    [project.entry-points."crossray.renderers"]
    my-renderer = "my_module"
"""

from __future__ import annotations

import pkgutil
import re
import traceback
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import cast

import translator.renderers
from reference.errors import InputError, RendererError
from translator.contract import Adapter, check_adapter

NATIVE, TRUTH = "native", "certified"
GROUP = "crossray.renderers"
NAME = r"[a-z0-9][a-z0-9-]{0,39}"  # of a renderer, fit for a folder


def renderer_names() -> list[str]:
    """Every renderer's name, `native` first; without `certified`, which the others are compared with."""
    names = {*own_renderers(), *_offers()[0]} - {TRUTH}
    return sorted(names, key=lambda name: (name != NATIVE, name))


def check_names(names: list[str]) -> None:
    """Raise InputError for a name that is no renderer's."""
    known = renderer_names()
    for name in names:
        if name not in known:
            raise InputError(f"expected a renderer ({', '.join(known)}), found {name!r}")


def adapter(name: str) -> Adapter:
    """The adapter of that name. Raises InputError for one that does not exist, RendererError for one that is unfit."""
    if name != TRUTH:
        check_names([name])
    if module := own_renderers().get(name):
        return cast(Adapter, import_module(module))
    try:
        return check_adapter(_offers()[0][name].load())
    except (Exception, SystemExit) as error:  # adapters can be anybody's
        reason = f"its adapter does not load: {type(error).__name__}: {error}"
        raise RendererError(reason, traceback.format_exc()) from error


def own_renderers() -> dict[str, str]:
    """Our modules by the names of their renderers, `certified` included."""
    path, package = translator.renderers.__path__, translator.renderers.__name__
    return {module.name.replace("_", "-"): f"{package}.{module.name}" for module in pkgutil.iter_modules(path)}


def ignored_offers() -> list[str]:
    """What others offer and nobody gets: a sentence each."""
    return _offers()[1]


def _offers() -> tuple[dict[str, EntryPoint], list[str]]:
    """What others offer, by name, and why the rest is ignored: a name must be fit for a folder, and free."""
    ours = own_renderers()
    offered: dict[str, EntryPoint] = {}
    ignored = []
    for point in sorted(entry_points(group=GROUP), key=_origin):
        if not re.fullmatch(NAME, point.name):
            reason = "expected a name of a-z, 0-9 and -"
        elif point.name in ours:
            reason = "crossray has a renderer of that name"
        elif point.name in offered:
            reason = f"{_origin(offered[point.name])} offers it, too"
        else:
            offered[point.name] = point
            continue
        ignored.append(f"{point.name!r} of {_origin(point)}: {reason}")
    return offered, ignored


def _origin(point: EntryPoint) -> str:
    return point.dist.name if point.dist else "an unknown distribution"
