"""``python -m hydrodamp`` is the command ``hydrodamp``."""

import os

INTERRUPTED = 130  # exit status, as of a shell


def main() -> None:
    """Load and run the command line; Ctrl-C ends it by its status while it loads too."""
    try:
        from hydrodamp.cli.main import main as run

        run()
    except KeyboardInterrupt:
        os.write(2, b"interrupted\n")
        os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
