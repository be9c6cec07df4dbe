"""The frozen behaviour of the package: what its commands print and write, kept as JSON and compared after a change."""
