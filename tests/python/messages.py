"""Writers of CCSDS orbit messages as their users find them: OMM and OEM in every notation."""

import json
from datetime import datetime, timedelta
from xml.sax.saxutils import escape

from sgp4.api import Satrec
from sgp4.exporter import export_omm

HEADER = {"CREATION_DATE": "2018-01-21T00:00:00", "ORIGINATOR": "NIGHT DESK"}
ROOT = (
    'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation='
    '"https://sanaregistry.org/r/ndmxml_unqualified/ndmxml-2.0.0-master-2.0.xsd"'
)
COVARIANCE = ("1e-6", "0 1e-6", "0 0 1e-6", "0 0 0 1e-12", "0 0 0 0 1e-12", "0 0 0 0 0 1e-12")
DECIMALS = {"MEAN_MOTION": 8, "ECCENTRICITY": 7, "MEAN_MOTION_DOT": 8}
METADATA = (
    "OBJECT_NAME",
    "OBJECT_ID",
    "CENTER_NAME",
    "REF_FRAME",
    "TIME_SYSTEM",
    "MEAN_ELEMENT_THEORY",
)
MEAN_ELEMENTS = (
    "EPOCH",
    "MEAN_MOTION",
    "ECCENTRICITY",
    "INCLINATION",
    "RA_OF_ASC_NODE",
    "ARG_OF_PERICENTER",
    "MEAN_ANOMALY",
)
UNITS = {
    "MEAN_MOTION": "rev/day",
    "INCLINATION": "deg",
    "RA_OF_ASC_NODE": "deg",
    "ARG_OF_PERICENTER": "deg",
    "MEAN_ANOMALY": "deg",
    "BSTAR": "1/ER",
    "MEAN_MOTION_DOT": "rev/day**2",
    "MEAN_MOTION_DDOT": "rev/day**3",
}
SPACE_TRACK_TAIL = {
    "SEMIMAJOR_AXIS": "6781.000",
    "PERIOD": "92.650",
    "OBJECT_TYPE": "PAYLOAD",
    "RCS_SIZE": "LARGE",
    "DECAY_DATE": None,
    "GP_ID": "116384",
}


def mean_elements(name, line1, line2):
    """Keyword -> value of an OMM, the numbers with the digits of the two-line set."""
    fields = export_omm(Satrec.twoline2rv(line1, line2), name)
    for keyword, value in fields.items():
        if keyword in ("BSTAR", "MEAN_MOTION_DDOT"):
            fields[keyword] = float(f"{value:.4e}")
        elif isinstance(value, float):
            fields[keyword] = round(value, DECIMALS.get(keyword, 4))
    days, fraction = line1[20:32].split(".")
    midnight = datetime(2000 + int(line1[18:20]), 1, 1) + timedelta(days=int(days) - 1)
    epoch = midnight + timedelta(microseconds=864 * int(fraction))
    return fields | {"EPOCH": epoch.isoformat(timespec="microseconds")}


def plain(value):
    """A number without an exponent, as Space-Track writes it; other values as they are."""
    return f"{value:.14f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def omm_kvn(fields):
    lines = [f"{key} = {value}" for key, value in {"CCSDS_OMM_VERS": "2.0", **HEADER}.items()]
    lines += ["", "COMMENT made from a two-line set"]
    for key, value in fields.items():
        note = f" [{UNITS[key]}]" if key in UNITS else ""
        lines.append(f"{key:20}= {plain(value)}{note}")
    return "\n".join(lines) + "\n"


def tags(fields):
    return "".join(f"<{key}>{escape(plain(value))}</{key}>\n" for key, value in fields.items())


def omm_xml(fields):
    """As Space-Track and CelesTrak send it: an NDM with one OMM."""

    def some(keys):
        return tags({key: fields[key] for key in keys})

    parameters = [key for key in fields if key not in METADATA + MEAN_ELEMENTS]
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<ndm {ROOT}>
<omm id="CCSDS_OMM_VERS" version="2.0">
<header>
{tags(HEADER)}</header>
<body><segment>
<metadata>
{some(METADATA)}</metadata>
<data>
<meanElements>
{some(MEAN_ELEMENTS)}</meanElements>
<tleParameters>
{some(parameters)}</tleParameters>
</data>
</segment></body>
</omm>
</ndm>
"""


def omm_space_track(fields):
    """JSON of Space-Track: every value a string, or null."""
    texts = {key: plain(value) for key, value in fields.items()}
    return json.dumps([{"CCSDS_OMM_VERS": "2.0", **HEADER, **texts, **SPACE_TRACK_TAIL}])


def omm_celestrak(fields):
    """JSON of CelesTrak: numbers; nothing of what goes without saying."""
    silent = ("CENTER_NAME", "REF_FRAME", "TIME_SYSTEM", "MEAN_ELEMENT_THEORY")
    return json.dumps([{key: value for key, value in fields.items() if key not in silent}])


def oem_metadata(segment, frame, time_system, interpolation, degree):
    """Keyword -> value; a segment is a list of (epoch, six numbers), usable but for its ends."""
    return {
        "OBJECT_NAME": "SATELLITE & CO",
        "OBJECT_ID": "1998-067A",
        "CENTER_NAME": "EARTH",
        "REF_FRAME": frame,
        "TIME_SYSTEM": time_system,
        "START_TIME": segment[0][0],
        "USEABLE_START_TIME": segment[1][0],
        "USEABLE_STOP_TIME": segment[-2][0],
        "STOP_TIME": segment[-1][0],
        "INTERPOLATION": interpolation,
        "INTERPOLATION_DEGREE": degree,
    }


def oem_kvn(segments, *properties):
    lines = ["CCSDS_OEM_VERS = 2.0", *(f"{key} = {value}" for key, value in HEADER.items())]
    for segment in segments:
        metadata = oem_metadata(segment, *properties)
        lines += ["", "META_START", *(f"{key} = {value}" for key, value in metadata.items())]
        lines += ["META_STOP", "COMMENT km and km/s"]
        lines += [f"{epoch} {' '.join(f'{x:.9f}' for x in state)}" for epoch, state in segment]
        lines += ["COVARIANCE_START", f"EPOCH = {segment[0][0]}", *COVARIANCE, "COVARIANCE_STOP"]
    return "\n".join(lines) + "\n"


def oem_xml(segments, *properties):
    axes = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
    body = ""
    for segment in segments:
        vectors = "".join(
            f"<stateVector>\n{tags({'EPOCH': epoch, **dict(zip(axes, state))})}</stateVector>\n"
            for epoch, state in segment
        )
        metadata = tags(oem_metadata(segment, *properties))
        body += f"<segment>\n<metadata>\n{metadata}</metadata>\n<data>\n"
        body += f"<COMMENT>km and km/s</COMMENT>\n{vectors}</data>\n</segment>\n"
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<oem id="CCSDS_OEM_VERS" version="2.0" {ROOT}>
<header>
{tags(HEADER)}</header>
<body>
{body}</body>
</oem>
"""
