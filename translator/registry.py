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
from translator.contract import Adapter

NATIVE, TRUTH = "native", "certified"
GROUP = "crossray.renderers"


def renderer_names() -> list[str]:
    """Every renderer's name, `native` first; without `certified`, which the others are compared with."""
    names = {*_own(), *_others()} - {TRUTH}
    return sorted(names, key=lambda name: (name != NATIVE, name))


def check_names(names: list[str]) -> None:
    """Raise InputError for a name that is no renderer's."""
    for name in names:
        if name not in renderer_names():
            raise InputError(f"expected a renderer ({', '.join(renderer_names())}), found {name!r}")


def adapter(name: str) -> Adapter:
    """The adapter of that name. Raises InputError for one that does not exist, RendererError if it does not load."""
    if name != TRUTH:
        check_names([name])
    if module := _own().get(name):
        return cast(Adapter, import_module(module))
    try:
        return cast(Adapter, _others()[name].load())
    except Exception as error:  # of somebody's module
        reason = f"its adapter does not load: {type(error).__name__}: {error}"
        raise RendererError(reason, traceback.format_exc()) from error


def _own() -> dict[str, str]:
    """Our modules by the names of their renderers."""
    path, package = translator.renderers.__path__, translator.renderers.__name__
    return {module.name.replace("_", "-"): f"{package}.{module.name}" for module in pkgutil.iter_modules(path)}


def _others() -> dict[str, EntryPoint]:
    """What others offer, under names that are fit for folders."""
    found = entry_points(group=GROUP)
    return {point.name: point for point in found if re.fullmatch(r"[a-z0-9][a-z0-9-]*", point.name)}
