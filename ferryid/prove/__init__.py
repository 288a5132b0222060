"""The proof: physics concealed by an independent plant, answers sealed, diagnosed blind, and scored against an oracle."""
