"""From Python source to machine code, by numba and LLVM."""
