"""Compilation of kernels, their cache, 3x3 tensors and threads."""
