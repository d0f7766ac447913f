"""A Foxglove server of estimates and messages, on the loopback interface."""

from __future__ import annotations

import json
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

from hydrodamp.errors import ProblemError

#: Layout of the panels, to be imported in Foxglove.
LAYOUT = Path(__file__).with_name("foxglove.json")

#: JSON schema of an estimate on its channel.
SCHEMA = Path(__file__).with_name("foxglove_schema.json")


class Display:
    """A server for clients on this machine."""

    def __init__(self, port: int) -> None:
        """Start the server at a port; 0 selects a free one."""
        try:
            import foxglove
            from foxglove.channels import LogChannel
        except ModuleNotFoundError as error:
            raise ProblemError(
                "`--foxglove` needs foxglove-sdk, which is not installed:"
                ' pip install "hydrodamp[live]"'
            ) from error
        context = self._context = foxglove.Context()
        schema = json.loads(SCHEMA.read_text("utf-8"))
        self._estimates = foxglove.Channel("/hydrodamp/estimate", schema=schema, context=context)
        self._messages = LogChannel("/hydrodamp/said", context=context)
        try:
            self._server = foxglove.start_server(name="hydrodamp", port=port, context=context)
        except (RuntimeError, OSError) as error:
            raise ProblemError(f"`--foxglove {port}`: cannot be served: {error}.") from error
        self.address = f"ws://127.0.0.1:{self._server.port}"

    def show_estimate(self, line: dict[str, Any]) -> None:
        """Show an estimate: all coefficients, and those of each axis."""
        rows = [{"label": label, **entry} for label, entry in line["coefficients"].items()]
        by_axis = defaultdict(list)
        for row in rows:
            by_axis[row["label"][0]].append(row)
        self._estimates.log({**line, "coefficients": rows, **by_axis})

    def show_message(self, message: str) -> None:
        """Show a message."""
        from foxglove.messages import Log, LogLevel, Timestamp

        now = Timestamp.from_epoch_secs(time.time())
        self._messages.log(Log(timestamp=now, level=LogLevel.Warning, message=message))

    def close(self) -> None:
        """Stop the server."""
        self._server.stop()
