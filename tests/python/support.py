"""What several cross-checks need: outside programs, units of a table."""

import os
import shutil

import astropy.units as u
import pytest


def tool(name):
    """Path of an outside program; without it the check is skipped, under CI=true it fails."""
    path = shutil.which(name)
    if path is None and os.environ.get("CI") == "true":
        pytest.fail(f"{name} is not installed")
    if path is None:
        pytest.skip(f"{name} is not installed")
    return path


def assert_units(table, units):
    """Every column of `units` is in the table and declares that unit (None: no matter which)."""
    for name, unit in units.items():
        assert name in table.colnames, name
        if unit is not None:
            assert u.Unit(table[name].unit) == u.Unit(unit), f"{name}: {table[name].unit}"
