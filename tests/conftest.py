"""Imported before any test: `reference` tells Dr.Jit which LLVM to use, which must come before `import drjit`."""

import reference

assert reference
