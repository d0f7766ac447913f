"""Entry point of ``hydrodamp`` and ``python -m hydrodamp``."""

import os

INTERRUPTED = 130  # exit status after SIGINT, 128 + 2


def main() -> None:
    """Run the command line; Ctrl-C while modules load also exits with status 130."""
    try:
        from hydrodamp.cli.main import main as run

        run()
    except KeyboardInterrupt:
        os.write(2, b"interrupted\n")
        os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
