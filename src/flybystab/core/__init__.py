"""Ground floor: compiled kernels on SI floats and small arrays. No objects with units, no astropy."""
