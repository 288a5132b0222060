"""The vessel's motion control: guidance, reference filter, PID with model feedforward, allocation, and open-loop tests."""
