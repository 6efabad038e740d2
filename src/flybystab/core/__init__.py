"""Compiled kernels on SI floats and small arrays; no objects with units, no astropy."""
