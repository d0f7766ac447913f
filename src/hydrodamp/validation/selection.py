"""What a selection of terms did, for a person to follow and to doubt."""

from __future__ import annotations

from dataclasses import dataclass

from hydrodamp.models.model import DampingModel


@dataclass(frozen=True)
class Entered:
    """A coefficient that was chosen at some point."""

    label: str
    ratio: float
    frequency: float


@dataclass(frozen=True)
class Size:
    """One of the nested models that elimination leaves."""

    n_coefficients: int
    error: float


@dataclass(frozen=True)
class Round:
    """One round: selection around a model, and the replay of what was selected."""

    window: float
    n_candidates: int
    entered: tuple[Entered, ...]
    sizes: tuple[Size, ...]
    model: DampingModel
    words: str
    rms: float | None
    push: float

    def __str__(self) -> str:
        """Return a paragraph and the terms."""
        replayed = "diverged" if self.rms is None else f"RMS {self.rms:.3g} on the training data"
        chosen = set(self.model.labels)
        named = (
            f"{entry.label} ({entry.frequency:.0%})"
            for entry in self.entered
            if entry.label in chosen
        )
        return (
            f"Windows of {self.window:g} s, {self.n_candidates} candidates: {self.words}\n"
            f"  Replay {replayed}; worst power on the operating box {self.push:.3g} W.\n"
            f"  In order of entry, and how often on half of the data: {', '.join(named)}"
        )


@dataclass(frozen=True)
class Selection:
    """A selected model and how it was come by.

    Attributes
    ----------
    model : DampingModel
        Key ``sparse``.
    rounds : tuple of Round
        All rounds; each starts from the model of the one before.
    chosen : int
        Which of them the model is from, from 0.
    why : str
        In words.
    """

    model: DampingModel
    rounds: tuple[Round, ...]
    chosen: int
    why: str

    def __str__(self) -> str:
        """Return the model, and round by round what was done."""
        told = "\n".join(f"{number}. {each}" for number, each in enumerate(self.rounds, start=1))
        return (
            f"{self.model.n_coefficients} coefficients: {' '.join(self.model.labels)}\n"
            f"{self.why}\n{told}"
        )
