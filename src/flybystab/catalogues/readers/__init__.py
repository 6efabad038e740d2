"""Readers of files of asteroids, one module a format (:mod:`flybystab.catalogues.readers.registry`)."""
