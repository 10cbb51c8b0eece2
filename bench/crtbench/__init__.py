"""Measurements of crt: one module per subcommand of bench/run, and what they share."""
