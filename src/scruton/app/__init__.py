"""One short function a verb: from arguments to results in a folder and text for the terminal."""
