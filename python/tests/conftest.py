"""Where the repository is, and the executable to compare with: ``ANHYST_EXECUTABLE``, or what cargo built."""

import os
import pathlib

import pytest

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def scenarios():
    return REPOSITORY / "scenarios"


@pytest.fixture(scope="session")
def executable():
    told = os.environ.get("ANHYST_EXECUTABLE", REPOSITORY / "target/release/anhyst")
    if not pathlib.Path(told).exists():
        pytest.skip(f"{told} is not there to compare with: build it, or name one by ANHYST_EXECUTABLE")
    return str(told)


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
