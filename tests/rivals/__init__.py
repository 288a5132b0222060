"""Estimators of ferryid and their rivals on the same rows: ``make rivals`` writes reports/rivals.md."""
