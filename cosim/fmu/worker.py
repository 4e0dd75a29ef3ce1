"""The process of one FMU: takes requests until there are no more. Started by `FmuProcess`."""

from __future__ import annotations

import os
import pickle
import sys
import threading
from time import sleep
from typing import Any, Final

from cosim.fmu.participant import FmuParticipant
from cosim.fmu.process import Logged, Reply, Request

_GLANCE: Final = 1.0
"""How often to look whether the parent is still there, s."""


class Worker:
    """One FMU, and its states by key.

    Parameters
    ----------
    fmu : FmuParticipant
        Not yet initialized.
    """

    def __init__(self, fmu: FmuParticipant) -> None:
        self._fmu = fmu
        self._states: dict[int, Any] = {}
        self._keys = 0

    def answer(self, request: Request) -> Reply:
        """Do what a request asks for."""
        result, error = None, None
        try:
            if request.inputs:
                self._fmu.write(request.inputs)
            result = self._do(request.method, request.arguments)
        except Exception as failure:  # whatever it is, it is raised again in the parent
            error = failure
        return Reply(result, error, self._fmu.read())

    def _do(self, method: str, arguments: tuple[Any, ...]) -> Any:
        if method == "get_state":
            self._keys += 1
            self._states[self._keys] = self._fmu.get_state()
            return self._keys
        if method == "set_state":
            return self._fmu.set_state(self._states[arguments[0]])
        if method == "free_state":
            return self._fmu.free_state(self._states.pop(arguments[0]))
        return getattr(self._fmu, method)(*arguments)


def main(parent: int) -> None:
    """Serve the process with the id `parent` over standard input and output."""
    requests, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)  # what the FMU prints must not come between
    threading.Thread(target=_leave_with, args=(parent,), daemon=True).start()

    def send(answer: Logged | Reply) -> None:
        pickle.dump(answer, replies)
        replies.flush()

    opening: Request = pickle.load(requests)  # noqa: S301 - from a process of our own
    path, name, parameters, run_as = opening.arguments
    fmu = FmuParticipant(path, name, parameters, run_as=run_as)
    fmu.log.relay = lambda status, message: send(Logged(status, message))
    send(Reply(None, None, {}))
    worker = Worker(fmu)
    while True:
        try:
            request: Request = pickle.load(requests)  # noqa: S301
        except EOFError:
            break
        send(worker.answer(request))
    fmu.close()
    os._exit(0)  # without a farewell of all that was imported: it takes a second


def _leave_with(parent: int) -> None:
    """Leave when the parent has: a hanging FMU never comes back to see that nobody asks."""
    while os.getppid() == parent:
        sleep(_GLANCE)
    os._exit(1)


if __name__ == "__main__":
    main(int(sys.argv[1]))
