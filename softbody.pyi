from cosim import *
from scenarios import *
from softbody_core import *

def main() -> int: ...
