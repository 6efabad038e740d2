"""A homogeneous polyhedron: gravity of its volume in closed form."""
