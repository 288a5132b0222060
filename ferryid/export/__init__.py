"""Models as code and parameters for other programs, and logs with a model's forces as MCAP files for viewers."""
