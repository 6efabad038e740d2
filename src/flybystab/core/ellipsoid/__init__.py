"""A homogeneous ellipsoid: self-gravity, tide, stress of rigid rotation, surface slope, bound mass."""
