"""`python -m scruton` is `scruton`, for who has the package but not its command on PATH."""

import sys

from scruton.cli import main

if __name__ == "__main__":
    sys.exit(main())
