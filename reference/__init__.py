"""What the assignment means: a scene, its picture, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from reference.device import load_drjit, provide_llvm
from reference.errors import CrossrayError, SceneError, SceneWarning
from reference.scene import Plane, Scene, Sphere

if TYPE_CHECKING:
    from reference.model import CONVENTIONS, DOCUMENT, EXACT, PUBLISHED, Model
    from reference.tracer import render

__all__ = [
    "CONVENTIONS",
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

provide_llvm()  # Dr.Jit looks for its LLVM when it is imported

_LAZY = dict.fromkeys(("CONVENTIONS", "DOCUMENT", "EXACT", "PUBLISHED", "Model"), "model") | {"render": "tracer"}


def __getattr__(name: str) -> Any:
    """Import the tracer, and with it Dr.Jit, only when it is asked for."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    load_drjit()
    return getattr(import_module(f"reference.{_LAZY[name]}"), name)
