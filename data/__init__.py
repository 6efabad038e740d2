"""The embedded catalogue: read it through :mod:`flybystab.catalogues.catalogue`."""
