"""What a scenario is: TOML tables, read and checked."""
