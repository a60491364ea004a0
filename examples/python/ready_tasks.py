"""Where the ready tasks are: CONFIG, of the project around these scripts, or as Debian's package installs them."""
from pathlib import Path

CONFIG = Path(__file__).resolve().parent / "../../config"
if not CONFIG.is_dir():
    CONFIG = Path("/usr/share/forereach/config")
