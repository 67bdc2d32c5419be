"""Make palace_continuum.csv and features.csv: `python update.py PALACE_TABLE`.

PALACE_TABLE is the reference continuum of PALACE v1.0 (Noll et al. 2025), R/nm, in columns nm, HO2, FeO, O2.
Bands of OH are spread over their branches: 25 % from the band's beginning to its Q head, 26 % over 2.5 nm from
the head on, 49 % from there to the end (rotational temperature 200 K).
"""

import sys
from pathlib import Path

HERE = Path(__file__).parent

# band, first and last wavelength, Q head [nm, vacuum], intensity at the zenith [R]
OH = [
    ("OH 8-2", 586.6, 607.0, 589.0, 39),
    ("OH 5-0", 613.8, 630.0, 617.2, 20),
    ("OH 9-3", 622.0, 645.0, 626.0, 75),
    ("OH 6-1", 646.5, 670.0, 650.05, 120),
    ("OH 7-2", 682.5, 708.0, 686.6, 150),
    ("OH 8-3", 723.5, 748.0, 727.8, 415),
    ("OH 4-0", 748.4, 771.0, 752.8, 160),
    ("OH 9-4", 771.2, 805.0, 775.5, 650),
    ("OH 5-1", 786.8, 816.0, 791.6, 520),
    ("OH 6-2", 827.0, 860.5, 834.7, 1120),
    ("OH 7-3", 875.5, 925.0, 883.0, 2090),
    ("OH 8-4", 930.8, 968.0, 937.9, 3000),
    ("OH 3-0", 965.5, 1013.0, 979.4, 3000),
    ("OH 9-5", 994.5, 1030.0, 1001.6, 2545),
    ("OH 4-1", 1014.5, 1066.0, 1029.0, 6860),
    ("OH 5-2", 1068.7, 1123.0, 1083.4, 9530),
]
# feature, first and last wavelength, R, layer [km], factor const + slope F10.7, 1 at the reference flux
LINES = [
    ("[OI] 557.7", 557.6, 557.9, 163, 97, -0.1245, 8.703e-3, 100),
    ("[OI] 630.0", 629.9, 630.2, 123, 250, 0.1214, 6.799e-3, 100),
    ("[OI] 636.4", 636.2, 636.5, 41, 250, 0.1214, 6.799e-3, 100),
    ("[NI] 520.0", 519.7, 520.3, 5, 250, 0.1214, 6.799e-3, 129),
    ("Na D", 588.9, 589.7, 43, 92, 0.8541, 1.130e-3, 129),
    ("O2 0-1 R", 860.7, 864.3, 128, 94, 0.1904, 6.265e-3, 129),
    ("O2 0-1 P", 864.9, 871.5, 195, 94, 0.1904, 6.265e-3, 129),
]
# wavelength [nm], continuum [R/nm] at F10.7 = 129 sfu
# up to 767 nm Noll et al. 2012; beyond, theirs holds what is left of the lines: instead the floor between the lines of the
# UVES sky atlas on the scale of a mean night (10 R/nm), less zodiacal light and stars (3 R/nm)
RED_CONTINUUM = [(650, 4.6), (700, 5.4), (767, 7.0), (900, 7.0), (1124, 8.0)]


def continuum(source):
    rows = [line.split(",") for line in source.read_text().splitlines() if line[:1].isdigit()]
    head = """# Airglow continuum at the zenith without atmosphere, by emitter; rayleigh per nm.
# Source: PALACE v1.0 (Noll et al. 2025, Geosci. Model Dev. 18, 4353; Zenodo 14064023, CC BY 4.0), reference state at Cerro Paranal,
# F10.7 = 100 sfu, 300-650 nm. red: 650-1124 nm, F10.7 = 129 sfu, the continuum of Noll et al. 2012, A&A 543, A92, to 767 nm, joined
# to the sum of the others at 650 nm; beyond, an ESTIMATE (30 %) from the floor between the lines of Hanuschik 2003, A&A 407, 1157.
# Layers: HO2 81 km, FeO 88 km, O2 94 km, red 90 km.
wavelength_nm,HO2,FeO,O2,red
"""
    lines = [",".join(row) + ",0" for row in rows]
    lines[-1] = "650,0,0,0,%g" % RED_CONTINUUM[0][1] if rows[-1][0] == "650" else lines[-1]
    lines += ["%g,0,0,0,%g" % point for point in RED_CONTINUUM[1:]]
    (HERE / "palace_continuum.csv").write_text(head + "\n".join(lines) + "\n")


def features():
    head = """# Lines and bands of the airglow at the zenith without atmosphere; rayleigh, spread evenly in photons from first_nm to last_nm.
# Strength = rayleigh x (solar_const + solar_per_sfu x F10.7) / the same at solar_at_sfu.
# Sources: [OI] PALACE v1.0 (Noll et al. 2025); [NI], Na, O2 and the solar factors: Noll et al. 2012, A&A 543, A92;
# OH: ESTIMATE, 20 % in the sum: bands below 930 nm integrated in the UVES sky atlas (Hanuschik 2003, A&A 407, 1157) and brought
# to the mean night of Noll et al. 2012, beyond from their lines (Rousselot et al. 2000, A&A 354, 1134).
feature,first_nm,last_nm,rayleigh,layer_km,solar_const,solar_per_sfu,solar_at_sfu
"""
    rows = [",".join(str(cell) for cell in line) for line in LINES]
    for name, first, last, head_nm, rayleigh in OH:
        end = head_nm + 2.5
        for branch, low, high, share in [("R", first, head_nm, 0.25), ("Q", head_nm, end, 0.26), ("P", end, last, 0.49)]:
            rows.append(f"{name} {branch},{low:g},{high:g},{rayleigh * share:.5g},87,0.992,6.2e-5,129")
    (HERE / "features.csv").write_text(head + "\n".join(rows) + "\n")


if __name__ == "__main__":
    continuum(Path(sys.argv[1]))
    features()
