"""``softbody export``: a scenario's body as an FMU, and with its controller as an SSP."""
