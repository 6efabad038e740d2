"""Equations of motion of the ellipsoid and their integration: rigid, flowing and dispersed regimes."""
