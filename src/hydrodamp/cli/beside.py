"""What ``identify`` writes beside its damping file: pictures and a report, named after it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Beside:
    """Where pictures and report of a damping file go."""

    damping: Path

    @property
    def figures(self) -> Path:
        """Folder of the pictures."""
        return self._named("figures")

    @property
    def report(self) -> Path:
        """The report."""
        return self._named("report.html")

    def check(self, inputs: Iterable[str | None]) -> None:
        """Refuse targets that cannot be written or would replace an input."""
        from hydrodamp.cli.targets import check_out_file
        from hydrodamp.files import check_folder

        read = tuple(inputs)
        check_out_file(str(self.damping), read)
        check_out_file(str(self.report), read)
        check_folder(self.figures)

    def earlier(self) -> list[Path]:
        """Return what an earlier fit may have left: its report and its pictures."""
        from hydrodamp.report.gallery.folder import earlier_pictures

        return [self.report, *earlier_pictures(self.figures)]

    def _named(self, end: str) -> Path:
        name = self.damping.name
        stem = name[: -len(".json")] if name.lower().endswith(".json") else name
        return self.damping.with_name(f"{stem}.{end}")
