"""Reports: the only place that draws."""
