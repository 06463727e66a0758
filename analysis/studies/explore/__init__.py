"""A page in which the core itself, compiled to WebAssembly, presses a crowd."""
