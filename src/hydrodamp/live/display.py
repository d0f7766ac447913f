"""What a run tells, to whoever looks at it with Foxglove on this machine."""

from __future__ import annotations

import time
from collections import defaultdict
from pathlib import Path
from typing import Any

from hydrodamp.errors import ProblemError

#: How the panels of Foxglove are laid out, to be imported there.
LAYOUT = Path(__file__).with_name("foxglove.json")

_NUMBER = {"type": ["number", "null"]}
_COEFFICIENT = {
    "type": "object",
    "properties": {
        "label": {"type": "string"},
        "value": _NUMBER,
        "standard_error": _NUMBER,
        "grade": {"type": "string"},
        "cause": {"type": ["string", "null"]},
    },
}
_LIST = {"type": "array", "items": _COEFFICIENT}
_ESTIMATE = {
    "type": "object",
    "properties": {
        "time": _NUMBER,
        "method": {"type": "string"},
        "coefficients": _LIST,
        **dict.fromkeys("XYZKMN", _LIST),
        "excitation": {"type": "object", "properties": dict.fromkeys("XYZKMN", _NUMBER)},
        "model_form": {"type": "array", "items": {"type": "string"}},
        "alarm": {"type": "object"},
        "counts": {"type": "object"},
    },
}


class Display:
    """A server of what a run tells; nobody else's machine reaches it."""

    def __init__(self, port: int) -> None:
        """Serve at a port of this machine; any free one for 0."""
        try:
            import foxglove
            from foxglove.channels import LogChannel
        except ModuleNotFoundError as error:
            raise ProblemError(
                "`--foxglove` needs foxglove-sdk, which is not installed:"
                ' pip install "hydrodamp[live]"'
            ) from error
        context = self._context = foxglove.Context()
        self._estimates = foxglove.Channel("/hydrodamp/estimate", schema=_ESTIMATE, context=context)
        self._said = LogChannel("/hydrodamp/said", context=context)
        try:
            self._server = foxglove.start_server(name="hydrodamp", port=port, context=context)
        except (RuntimeError, OSError) as error:
            raise ProblemError(f"`--foxglove {port}`: it cannot be served: {error}.") from error
        self.address = f"ws://127.0.0.1:{self._server.port}"

    def show_estimate(self, line: dict[str, Any]) -> None:
        """Show an estimate: all coefficients, and once more by their axes."""
        rows = [{"label": label, **one} for label, one in line["coefficients"].items()]
        by_axis = defaultdict(list)
        for row in rows:
            by_axis[row["label"][0]].append(row)
        self._estimates.log({**line, "coefficients": rows, **by_axis})

    def show_message(self, sentence: str) -> None:
        """Show a sentence."""
        from foxglove.messages import Log, LogLevel, Timestamp

        now = Timestamp.from_epoch_secs(time.time())
        self._said.log(Log(timestamp=now, level=LogLevel.Warning, message=sentence))

    def close(self) -> None:
        """End the server."""
        self._server.stop()
