"""The documents: their drawing, their code blocks, their words, and the site they build."""
