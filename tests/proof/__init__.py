"""The page of both proofs, from their stored results."""
