"""Yield surfaces and the flow rule of a granular material."""
