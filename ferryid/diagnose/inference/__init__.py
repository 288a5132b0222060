"""What a log speaks for: the weak form, whitening, likelihood, search and evidence."""
