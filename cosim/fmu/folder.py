"""An FMU unpacked into a folder of its own, with what Python FMUs need to live side by side."""

from __future__ import annotations

import hashlib
import shutil
import tempfile
import zipfile
from pathlib import Path

from cosim.errors import FmuError


class FmuFolder:
    """Temporary folder with the content of one FMU; `close` removes it.

    The binary of a Python FMU imports the script named in ``resources/slavemodule.txt`` by its
    stem. Two FMUs with one stem would both run the first one's code, and a stem that is already
    imported, such as that of a standard module, crashes the process. So the script is renamed
    after its own content here, before anything is loaded.

    Parameters
    ----------
    path : Path
        The FMU.

    Raises
    ------
    FmuError
        If the file does not exist or is no FMU.
    """

    def __init__(self, path: Path) -> None:
        if not path.is_file():
            raise FmuError(f"FMU {path} does not exist; check the path")
        self.path = Path(tempfile.mkdtemp(prefix="softbody-fmu-"))
        try:
            _unpack(path, self.path)
            _rename_python_script(path, self.path / "resources")
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.path, ignore_errors=True)


def _unpack(path: Path, folder: Path) -> None:
    try:
        with zipfile.ZipFile(path) as archive:
            if "modelDescription.xml" not in archive.namelist():
                raise FmuError(f"{path} is no FMU: it holds no modelDescription.xml")
            archive.extractall(folder)
    except (zipfile.BadZipFile, OSError) as error:
        raise FmuError(f"{path} is no FMU: it cannot be unpacked ({error})") from error


def _rename_python_script(path: Path, resources: Path) -> None:
    """Give the script of a Python FMU a name that no other has; other FMUs have none."""
    pointer = resources / "slavemodule.txt"
    if not pointer.is_file():
        return
    stem = pointer.read_text(encoding="utf-8").strip()
    script = resources / f"{stem}.py"
    if not script.is_file():
        raise FmuError(f"FMU {path}: its Python script {stem}.py is missing from resources")
    unique = f"fmu_{hashlib.sha256(path.read_bytes()).hexdigest()[:24]}"
    script.rename(resources / f"{unique}.py")
    pointer.write_text(unique, encoding="utf-8")
