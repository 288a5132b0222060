"""One module per log format: `bases()` writes its undamaged logs, and MUTATIONS holds what is done to them by kind."""
