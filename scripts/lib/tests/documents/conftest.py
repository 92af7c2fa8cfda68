"""The scripts' library and the helpers beside this file are no packages: put them on the path."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[2])]
