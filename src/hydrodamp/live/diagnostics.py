"""What an estimate line says, as a status for an operator."""

from __future__ import annotations

from collections import Counter
from typing import Any

from hydrodamp.identification.identifiability import Grade


def diagnostic_status(line: dict[str, Any]) -> tuple[bool, str, dict[str, str]]:
    """Return whether an operator should look at it, a sentence, and values by name."""
    grades = Counter(one["grade"] for one in line["coefficients"].values())
    determined = grades[Grade.DETERMINED.word]
    message = f"{determined} of {grades.total()} coefficients are determined"
    alarm, last = line["alarm"], line["alarm"]["last"]
    if last:
        axes = ", ".join(last["axes"])
        message = f"the vehicle has changed at about {last['since']:.0f} s on {axes}; {message}"
    values = {f"excitation {axis}": f"{value:.4g}" for axis, value in line["excitation"].items()}
    values |= {f"{grade.word}": str(grades[grade.word]) for grade in Grade}
    values |= {"alarm armed": " ".join(alarm["armed"]), "changes": str(alarm["changes"])}
    values |= {f"alarm {axis}": reason for axis, reason in alarm["not_armed"].items()}
    values |= {name: str(count) for name, count in line["counts"].items()}
    return not determined or last is not None, message, values
