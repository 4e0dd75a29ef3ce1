"""From a scenario to a dataset."""
