"""Encounter rates of populations of asteroids with the planets."""
