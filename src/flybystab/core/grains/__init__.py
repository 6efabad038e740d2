"""Discrete elements: soft spheres with contact history, gravity and tide; clumps of them."""
