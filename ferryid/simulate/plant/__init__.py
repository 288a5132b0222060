"""The simulated vessel: one file for each load on the hull, the actuators, and the integrator."""
