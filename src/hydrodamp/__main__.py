"""``python -m hydrodamp`` is the command ``hydrodamp``."""

from hydrodamp.cli.main import main

if __name__ == "__main__":
    main()
