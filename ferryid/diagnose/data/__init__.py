"""What is measured from a log."""
