"""Encounters of many asteroids found by compiled integrations."""
