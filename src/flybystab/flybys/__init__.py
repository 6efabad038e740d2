"""A body through an encounter: result, verdict, margin, survival."""
