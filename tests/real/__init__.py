"""The recordings of real vessels, which are not part of the project: what fits and diagnoses make of them."""
