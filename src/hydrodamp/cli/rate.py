"""How fast work goes, as a column of a progress bar."""

from __future__ import annotations

from rich.console import RenderableType
from rich.progress import ProgressColumn, Task
from rich.text import Text


class RateColumn(ProgressColumn):
    """Steps a second, or seconds a step."""

    def render(self, task: Task) -> Text:
        """Return the rate of a task so far."""
        return Text(pace(task.finished_speed or task.speed), style="progress.data.speed")


class OnceKnown(ProgressColumn):
    """A column that stays empty until it is known of how many steps the work consists."""

    def __init__(self, column: ProgressColumn) -> None:
        super().__init__()
        self.column = column

    def render(self, task: Task) -> RenderableType:
        """Return what the column says of a task."""
        return Text("") if task.total is None else self.column(task)


def pace(speed: float | None) -> str:
    """Return a rate in words."""
    if not speed:
        return "- s each"
    if speed < 1.0:
        return f"{1.0 / speed:.1f} s each"
    return f"{speed:.1f}/s" if speed < 100.0 else f"{speed:.0f}/s"
