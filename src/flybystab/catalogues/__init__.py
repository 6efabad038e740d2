"""Asteroids and the formats in which their data are published."""
