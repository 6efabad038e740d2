"""Documents, scenario files, reports and citations."""
