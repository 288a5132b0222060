"""Published results flown again in the simulator: theirs beside ours, and why they differ."""
