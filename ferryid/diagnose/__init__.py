"""What a model left out: sensor checks, hypotheses, evidence, verdict."""
