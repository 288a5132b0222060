"""Attack on the readers: logs of every format, damaged and hostile, and what must hold whatever they contain."""
