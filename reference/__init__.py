"""What the assignment means: a scene, its picture, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from reference.errors import CrossrayError, SceneError, SceneWarning
from reference.scene import Plane, Scene, Sphere

if TYPE_CHECKING:
    from reference.model import DOCUMENT, EXACT, PUBLISHED, Model
    from reference.tracer import render

__all__ = [
    "DOCUMENT",
    "EXACT",
    "PUBLISHED",
    "CrossrayError",
    "Model",
    "Plane",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Sphere",
    "render",
]

_LAZY = {"render": "tracer", "Model": "model", "DOCUMENT": "model", "EXACT": "model", "PUBLISHED": "model"}


def __getattr__(name: str) -> Any:
    """Import the tracer, and with it Dr.Jit and the right LLVM, only when it is asked for."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    from reference.device import provide_llvm

    provide_llvm()
    return getattr(import_module(f"reference.{_LAZY[name]}"), name)
