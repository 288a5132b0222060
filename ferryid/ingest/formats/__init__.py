"""One module per log format; each exports a Format as FORMAT and is found by `open_log`."""
