"""How kernels are compiled: as little as is called, and each once."""

from nscd.compiling.decorators import inner, kernel

__all__ = ["inner", "kernel"]
