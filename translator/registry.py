"""Which renderers there are: the modules in `translator/renderers`."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from typing import cast

import translator.renderers
from reference.errors import InputError
from translator.contract import Adapter

NATIVE, TRUTH = "native", "certified"


def renderer_names() -> list[str]:
    """Every renderer's name, `native` first; without `certified`, which the others are compared with."""
    names = [module.name.replace("_", "-") for module in pkgutil.iter_modules(translator.renderers.__path__)]
    return sorted((name for name in names if name != TRUTH), key=lambda name: (name != NATIVE, name))


def check_names(names: list[str]) -> None:
    """Raise InputError for a name that is no renderer's."""
    for name in names:
        if name not in renderer_names():
            raise InputError(f"expected a renderer ({', '.join(renderer_names())}), found {name!r}")


def adapter(name: str) -> Adapter:
    """The adapter of that name. Raises InputError for one that does not exist."""
    if name != TRUTH:
        check_names([name])
    return cast(Adapter, import_module(f"translator.renderers.{name.replace('-', '_')}"))
