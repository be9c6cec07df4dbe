"""Speed of what users wait for, on one core: `make bench`, or `python -m benchmarks NAME ...` for some of it."""
