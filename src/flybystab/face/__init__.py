"""What people touch: the command line, plots and reports."""
