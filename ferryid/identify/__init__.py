"""Identification: residual, basis, SIMPLS on cross-products, validation, acceptance and the model store."""
