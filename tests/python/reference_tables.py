"""Reference numbers as CSV: `python tests/python/reference_tables.py [NAME...]` writes them.

Each table is a function that returns rows (dictionaries, column -> value); its docstring is the
comment at the top of the file tests/reference/NAME.csv. Input, committed and not written:
satellites.tle, elements copied from Debian's package gpredict (2.3-72-gc596101-3).
"""

import inspect
import sys
from pathlib import Path

import reference_motion
import reference_sky

DIRECTORY = Path(__file__).resolve().parents[1] / "reference"
TABLES = {
    table.__name__: table
    for table in (
        reference_sky.orientation,
        reference_motion.sgp4_vallado,
        reference_motion.sgp4_vallado_errors,
        reference_sky.stars,
        reference_motion.satellites,
        reference_motion.eclipses,
        reference_sky.bodies,
        reference_sky.libration,
        reference_sky.libration_iau,
        reference_motion.tumble,
    )
}


def cell(value):
    """Text of one value: floats by repr, 17 digits where they are needed."""
    if isinstance(value, str):
        assert "," not in value and '"' not in value
        return value
    return repr(int(value) if isinstance(value, int) else float(value))


def comment(name):
    """The comment lines of a table."""
    return [f"# {line}".rstrip() for line in inspect.getdoc(TABLES[name]).splitlines()]


def text(name):
    """The whole CSV file."""
    rows = TABLES[name]()
    lines = [",".join(rows[0])]
    lines += [",".join(cell(value) for value in row.values()) for row in rows]
    return "\n".join(comment(name) + lines) + "\n"


def main(names):
    DIRECTORY.mkdir(exist_ok=True)
    (DIRECTORY / "sgp4_vallado.tle").write_text(reference_motion.vallado_elements())
    for name in names or TABLES:
        (DIRECTORY / f"{name}.csv").write_text(text(name))
        print(name)


if __name__ == "__main__":
    main(sys.argv[1:])
