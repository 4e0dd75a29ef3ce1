"""Sources of FMUs that tests build."""
