"""How fast work goes, as a column of a progress bar."""

from __future__ import annotations

from rich.console import RenderableType
from rich.progress import ProgressColumn, Task
from rich.text import Text


class RateColumn(ProgressColumn):
    """Steps a second, or seconds a step."""

    def render(self, task: Task) -> Text:
        """Return the rate of a task so far.

        Parameters
        ----------
        task : Task
            Any.

        Returns
        -------
        words : Text
            As of :func:`pace`.
        """
        return Text(pace(task.finished_speed or task.speed), style="progress.data.speed")


class OnceKnown(ProgressColumn):
    """A column that stays empty until it is known of how many steps the work consists.

    Parameters
    ----------
    column : ProgressColumn
        What is shown from then on.
    """

    def __init__(self, column: ProgressColumn) -> None:
        super().__init__()
        self.column = column

    def render(self, task: Task) -> RenderableType:
        """Return what the column says of a task.

        Parameters
        ----------
        task : Task
            Any.

        Returns
        -------
        words : renderable
            Nothing as long as there is no total.
        """
        return Text("") if task.total is None else self.column(task)


def pace(speed: float | None) -> str:
    """Return a rate in words.

    Parameters
    ----------
    speed : float or None
        Steps a second [1/s]; None or 0 where it is not known yet.

    Returns
    -------
    words : str
        Steps a second where that is more than one, else seconds a step.

    Examples
    --------
    >>> pace(12.3), pace(41259.6), pace(0.25), pace(None)
    ('12.3/s', '41260/s', '4.0 s each', '- s each')
    """
    if not speed:
        return "- s each"
    if speed < 1.0:
        return f"{1.0 / speed:.1f} s each"
    return f"{speed:.1f}/s" if speed < 100.0 else f"{speed:.0f}/s"
