"""fv_common of this checkout, for the scripts: --help must work before anything is set up."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "catkin_ws" / "src" / "fv_common" / "src"))

from fv_common.command import Parser, run
from fv_common.errors import UserError

__all__ = ["Parser", "UserError", "run"]
