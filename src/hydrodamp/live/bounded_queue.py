"""Bounded queue between the reader thread of a source and the run."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeVar

Item = TypeVar("Item")

POLL_INTERVAL = 0.2  # s, after which an idle source yields None; by choice
JOIN_TIMEOUT = 5.0  # s, that the end of a reader may take; by choice
MAX_QUEUE_LENGTH = 10_000  # rows or messages; by choice


class SourceError(Exception):
    """A source that can no longer be read."""


@dataclass
class BoundedQueue(Generic[Item]):
    """A bounded queue from a reader thread to the run; it counts the items it drops."""

    blocks_when_full: bool = False  # instead of dropping the oldest item
    dropped: int = 0
    is_cancelled: bool = False  # by the consumer
    is_finished: bool = False  # by the reader
    error: Exception | None = None  # of the reader
    thread: threading.Thread | None = None
    items: deque[Item] = field(default_factory=deque)
    changed: threading.Condition = field(default_factory=threading.Condition)

    def put(self, item: Item | None) -> None:
        """Append an item; drop the oldest one where the queue is full. None ends the stream."""
        with self.changed:
            while (
                self.blocks_when_full
                and len(self.items) >= MAX_QUEUE_LENGTH
                and not self.is_cancelled
            ):
                self.changed.wait(POLL_INTERVAL)
            if item is None:
                self.is_finished = True
            else:
                if len(self.items) >= MAX_QUEUE_LENGTH:
                    self.items.popleft()
                    self.dropped += 1
                self.items.append(item)
            self.changed.notify_all()

    def __iter__(self) -> Iterator[Item | None]:
        """Yield the items, and None after an interval without one."""
        while True:
            with self.changed:
                if not self.items and not self.is_finished:
                    self.changed.wait(POLL_INTERVAL)
                item = self.items.popleft() if self.items else None
                if item is None and self.is_finished:
                    break
                if len(self.items) == MAX_QUEUE_LENGTH - 1:
                    self.changed.notify_all()
            yield item
        if self.error is not None:
            text = f"{type(self.error).__name__}: {self.error}"
            raise SourceError(f"the source can no longer be read: {text}") from self.error

    def start_reader(self, read: Callable[[BoundedQueue[Item]], None]) -> BoundedQueue[Item]:
        """Start a thread that fills the queue; the consumer receives its error."""

        def run() -> None:
            try:
                read(self)
            except Exception as error:
                self.error = error
            finally:
                self.put(None)

        self.thread = threading.Thread(target=run, daemon=True)
        self.thread.start()
        return self

    def cancel(self) -> None:
        """Stop the reader and wait for its end; a reader of standard input may never end."""
        self.is_cancelled = True
        if self.thread is not None and not self.blocks_when_full:
            self.thread.join(JOIN_TIMEOUT)
