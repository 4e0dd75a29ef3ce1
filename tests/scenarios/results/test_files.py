from __future__ import annotations

from pathlib import Path

import netCDF4
import pytest
import xarray as xr

from scenarios import OutputError
from scenarios.results.files import check_writable, replacing, save


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_path_that_can_be_written_is_left_as_it_was(tmp_path: Path) -> None:
    check_writable(tmp_path / "out.nc", ".nc")
    assert _names(tmp_path) == []
    (tmp_path / "out.nc").write_text("older")
    check_writable(tmp_path / "out.nc", ".nc")
    assert (tmp_path / "out.nc").read_text() == "older"


def test_a_folder_is_no_output(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"is a folder; name a file in it, such as .*out\.nc"):
        check_writable(tmp_path, ".nc")


def test_the_folder_has_to_exist(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"folder .*none does not exist; make it first"):
        check_writable(tmp_path / "none" / "out.nc", ".nc")


def test_a_place_that_takes_no_files_is_found(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        check_writable(Path("/proc/out.nc"), ".nc")  # refuses files from everyone, root too


def test_the_file_is_netcdf4(sphere: xr.Dataset, tmp_path: Path) -> None:
    save(sphere, tmp_path / "out.nc")
    with netCDF4.Dataset(tmp_path / "out.nc") as file:
        assert file.data_model == "NETCDF4"
        assert file["volume"].units == "L"
    assert _names(tmp_path) == ["out.nc"]


def test_an_older_file_is_replaced(sphere: xr.Dataset, tmp_path: Path) -> None:
    (tmp_path / "out.nc").write_text("older")
    save(sphere, tmp_path / "out.nc")
    assert xr.load_dataset(tmp_path / "out.nc").sizes["time"] == 121


def test_an_older_file_stays_if_the_new_one_cannot_be_written(
    sphere: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(self: xr.Dataset, path: Path, **options: object) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    (tmp_path / "out.nc").write_text("older")
    monkeypatch.setattr(xr.Dataset, "to_netcdf", fail)
    with pytest.raises(OutputError, match="No space left"):
        save(sphere, tmp_path / "out.nc")
    assert _names(tmp_path) == ["out.nc"]
    assert (tmp_path / "out.nc").read_text() == "older"


def test_whatever_goes_wrong_an_older_file_stays_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "out.png"
    path.write_text("older")

    def fail_half_way() -> None:
        with replacing(path) as partial:
            assert partial.suffix == ".png"  # which tells matplotlib the format
            partial.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail_half_way()
    assert _names(tmp_path) == ["out.png"]
    assert path.read_text() == "older"


@pytest.mark.parametrize("name", ["mine.toml", "mine.fmu", "mine.ply", "out", "out.png"])
def test_another_kind_of_file_is_not_overwritten(tmp_path, name):
    with pytest.raises(OutputError, match=r"expected a name that ends in \.nc"):
        check_writable(tmp_path / name, ".nc")
