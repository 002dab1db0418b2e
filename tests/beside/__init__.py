"""An earlier commit beside the present one, each answering in a process of its own."""
