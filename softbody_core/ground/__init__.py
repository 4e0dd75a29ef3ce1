"""What every floor stands on: the base of the errors, parameters with units, types of arrays.

Also the one numerical method that two floors use: Anderson acceleration.
"""
