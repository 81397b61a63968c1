"""Which Dr.Jit backend computes, and with which LLVM."""

from __future__ import annotations

import importlib
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from reference.errors import DeviceError, InputError

PRECISIONS = ("auto", "double", "single")
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
    """The Dr.Jit array types of one backend at one precision; `Double` whatever the precision."""

    device: str
    Float: Any
    Index: Any
    Mask: Any
    Vector3: Any
    Vector4: Any
    Double: Any


def array_types(precision: str = "double", device: str = "auto") -> Types:
    """The types to compute with: those of double precision where that is `auto`.

    The device `auto` is a CUDA graphics card where there is one, else the processor.

    Raises InputError for an unknown name and DeviceError where the device cannot compute.
    """
    if precision not in PRECISIONS or device not in DEVICES:
        raise InputError(f"expected precision {PRECISIONS} on device {DEVICES}, found {precision!r} on {device!r}")
    drjit = load_drjit()
    if device == "auto":
        device = "gpu" if drjit.has_backend(drjit.JitBackend.CUDA) else "cpu"
    backend = drjit.JitBackend.CUDA if device == "gpu" else drjit.JitBackend.LLVM
    if device == "cpu":
        _check_llvm()
    if not drjit.has_backend(backend):
        raise DeviceError(_missing(device))
    module = importlib.import_module("drjit.cuda" if device == "gpu" else "drjit.llvm")
    double = module.Float64
    if precision != "single":
        return Types(device, double, module.UInt32, module.Bool, module.Array3f64, module.Array4f64, double)
    return Types(device, module.Float32, module.UInt32, module.Bool, module.Array3f, module.Array4f, double)


def provide_llvm() -> None:
    """Point Dr.Jit at the LLVM that came with crossray, unless the user chose one or Dr.Jit has already looked."""
    if not os.environ.get(LLVM_VARIABLE) and "drjit" not in sys.modules and (library := find_llvm()):
        os.environ[LLVM_VARIABLE] = str(library)


def load_drjit() -> Any:
    """Import Dr.Jit. Raises DeviceError where it cannot be loaded."""
    try:
        return importlib.import_module("drjit")
    except (ImportError, NameError) as error:  # its own handler of the first raises the second
        reason = str(error.__context__ or error)
        advice = "; to have it: apt-get install libatomic1" if "libatomic" in reason else ""
        raise DeviceError(f"Dr.Jit cannot be loaded: {reason}{advice}") from error


def find_llvm() -> Path | None:
    """The shared library of the LLVM wheel, or None where it has none for this platform."""
    for library in sorted(Path(sys.prefix, "lib").glob("libLLVM.so.*")):
        return library
    from importlib import metadata

    try:
        files = metadata.files(LLVM_PACKAGE) or []
    except metadata.PackageNotFoundError:
        return None
    return next((Path(str(file.locate())).resolve() for file in files if file.name.startswith("libLLVM.so.")), None)


def _check_llvm() -> None:
    """Try an LLVM that is not ours in a child process: a bad one aborts the whole process it runs in."""
    chosen = os.environ.get(LLVM_VARIABLE)
    if chosen in _tried:
        return
    if chosen and chosen == str(find_llvm()):
        _tried.add(chosen)
        return
    import subprocess

    if subprocess.run([sys.executable, "-c", _TRIAL], capture_output=True, check=False).returncode:
        if chosen and (library := find_llvm()):
            raise DeviceError(f"{LLVM_VARIABLE}={chosen} does not work with Dr.Jit; unset it to use {library}")
        if find_llvm():
            raise DeviceError("the system's LLVM does not work with Dr.Jit; import `reference` before drjit or mitsuba")
        raise DeviceError(_missing("cpu"))
    _tried.add(chosen)


_tried: set[str | None] = set()


def _missing(device: str) -> str:
    if device == "gpu":
        return "no CUDA graphics card that Dr.Jit can use; use --device cpu"
    return f"Dr.Jit found no LLVM that works on this machine; install one: pip install {LLVM_PACKAGE}"


def describe() -> list[tuple[str, bool, str]]:
    """For each part of the native tracer: its name, whether it works, and what is there or what to do."""
    try:
        drjit = load_drjit()
    except DeviceError as error:
        return [("Dr.Jit", False, str(error))]
    rows = [("Dr.Jit", True, drjit.__version__)]
    try:
        array_types(device="cpu")
        rows.append(("processor", True, f"LLVM from {os.environ.get(LLVM_VARIABLE) or 'the system'}"))
    except DeviceError as error:
        rows.append(("processor", False, str(error)))
    has_card = drjit.has_backend(drjit.JitBackend.CUDA)
    rows.append(("graphics card", True, "CUDA, used by default" if has_card else "none; the processor is used"))
    return rows
