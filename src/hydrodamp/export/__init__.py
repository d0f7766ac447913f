"""Into the simulator and the controller: files that other programs read, and how true they are."""
