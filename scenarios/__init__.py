"""What to run, and what comes of it.

>>> import scenarios
>>> lung = scenarios.load("sphere-lung", {"run.cycles": 1})
>>> float(scenarios.run(lung)["volume"].max()) > 5
True
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
