"""Controllers written in Python, asked by the lines of JSON that a process of one's own is asked by (docs/benchmark.md)."""

import inspect
import json

from ._errors import UsageError


def check(controller):
    """Raises UsageError for what cannot be called."""
    if not callable(controller):
        raise UsageError(f"a controller is a function of the state that returns levers by cylinder; got {controller!r}")


def asked(controller):
    """Makes a function that takes a line of JSON and gives one; of a class a new object is made now."""
    made = controller() if inspect.isclass(controller) else controller

    def ask(line):
        message = json.loads(line)
        if message["type"] == "task":
            if hasattr(made, "begin"):
                made.begin(message)
            return '{"type": "ready"}'
        answer = made(message)
        if not (isinstance(answer, dict) and isinstance(answer.get("u"), dict)):
            answer = {"u": {} if answer is None else answer}
        try:
            return json.dumps(answer, default=float, allow_nan=False)
        except ValueError:
            raise UsageError(f"the controller's levers are no finite numbers at {message.get('t_s')} s: {answer['u']!r}; "
                             "expected -1 to 1 by cylinder") from None

    return ask


def words(controller):
    """The first line of its documentation, or its name."""
    lines = (inspect.getdoc(controller) or getattr(controller, "__name__", "")).splitlines() or [""]
    return "function: " + lines[0]
