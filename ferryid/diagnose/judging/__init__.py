"""Whether what was selected stands: held-out tests, rivals, confidence rules, and the verdict."""
