"""Controllers that misbehave, as pythonfmu scripts."""
