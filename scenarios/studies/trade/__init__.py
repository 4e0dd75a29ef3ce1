"""Accuracy against cost: a grid of settings, each run against one converged reference."""
