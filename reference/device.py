"""Which Dr.Jit backend computes, and with which LLVM."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from reference.errors import DeviceError, InputError

PRECISIONS = ("double", "single")
DEVICES = ("auto", "cpu", "gpu")
LLVM_VARIABLE = "DRJIT_LIBLLVM_PATH"
LLVM_PACKAGE = "karellen-llvm-core"

# Debian's LLVM 14 and 15 abort on maximum() with AVX-512; the square root makes the kernel a real one.
_TRIAL = """
import drjit as dr
from drjit.llvm import Float64
x = dr.maximum(dr.sqrt(dr.arange(Float64, 64)), 2)
assert dr.sum(x)[0] > 300
"""


@dataclass(frozen=True)
class Types:
    """The Dr.Jit array types of one backend at one precision."""

    device: str
    Float: Any
    Index: Any
    Mask: Any
    Vector3: Any
    Vector4: Any


def array_types(precision: str = "double", device: str = "auto") -> Types:
    """The types to compute with. `auto` takes a CUDA graphics card where there is one, else the processor.

    Raises InputError for an unknown name and DeviceError where the device cannot compute.
    """
    if precision not in PRECISIONS or device not in DEVICES:
        raise InputError(f"expected precision {PRECISIONS} on device {DEVICES}, found {precision!r} on {device!r}")
    provide_llvm()
    import drjit

    if device == "auto":
        device = "gpu" if drjit.has_backend(drjit.JitBackend.CUDA) else "cpu"
    backend = drjit.JitBackend.CUDA if device == "gpu" else drjit.JitBackend.LLVM
    if device == "cpu":
        _check_llvm()
    if not drjit.has_backend(backend):
        raise DeviceError(_missing(device))
    module = importlib.import_module("drjit.cuda" if device == "gpu" else "drjit.llvm")
    if precision == "double":
        return Types(device, module.Float64, module.UInt32, module.Bool, module.Array3f64, module.Array4f64)
    return Types(device, module.Float32, module.UInt32, module.Bool, module.Array3f, module.Array4f)


def provide_llvm() -> None:
    """Point Dr.Jit at the LLVM that came with crossray, unless the user chose one. Call before importing drjit."""
    if not os.environ.get(LLVM_VARIABLE) and (library := find_llvm()):
        os.environ[LLVM_VARIABLE] = str(library)


def find_llvm() -> Path | None:
    """The shared library of the LLVM wheel, or None where it has none for this platform."""
    for library in sorted(Path(sys.prefix, "lib").glob("libLLVM.so.*")):
        return library
    try:
        files = metadata.files(LLVM_PACKAGE) or []
    except metadata.PackageNotFoundError:
        return None
    return next((Path(str(file.locate())).resolve() for file in files if file.name.startswith("libLLVM.so.")), None)


def _check_llvm() -> None:
    """Try an LLVM that is not ours in a child process: a bad one aborts the whole process it runs in."""
    chosen = os.environ.get(LLVM_VARIABLE)
    if chosen and chosen == str(find_llvm()):
        return
    if chosen in _tried:
        return
    trial = subprocess.run([sys.executable, "-c", _TRIAL], capture_output=True, text=True, timeout=120, check=False)
    if trial.returncode:
        if chosen and (library := find_llvm()):
            raise DeviceError(f"{LLVM_VARIABLE}={chosen} does not work with Dr.Jit; unset it to use {library}")
        raise DeviceError(_missing("cpu"))
    _tried.add(chosen)


_tried: set[str | None] = set()


def _missing(device: str) -> str:
    if device == "gpu":
        return "no CUDA graphics card that Dr.Jit can use; use --device cpu"
    return f"Dr.Jit found no LLVM that works on this machine; install one: pip install {LLVM_PACKAGE}"


def describe() -> list[tuple[str, bool, str]]:
    """For each part of the native tracer: its name, whether it works, and what is there or what to do."""
    import drjit

    rows = [("Dr.Jit", True, drjit.__version__)]
    try:
        array_types(device="cpu")
        rows.append(("processor", True, f"LLVM from {os.environ.get(LLVM_VARIABLE) or 'the system'}"))
    except DeviceError as error:
        rows.append(("processor", False, str(error)))
    has_card = drjit.has_backend(drjit.JitBackend.CUDA)
    rows.append(("graphics card", True, "CUDA, used by default" if has_card else "none; the processor is used"))
    return rows
