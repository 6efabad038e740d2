"""The embedded catalogue: read it through :mod:`flybystab.survey.catalogue`."""
