"""GalSim.

Usage: venv-galsim/bin/python galsim_sim.py --side 4096 --stars 2000 --streak 0 --frames 1 --seed 1 --out out/o.fits
   --psf gauss|moffat      PSF family (Moffat beta 3.5)
   --method auto|phot      drawImage method ('auto' = FFT/real space; 'phot' = photon shooting)
   --stage                 wall seconds per stage on stderr
Streaks: Convolve(PSF, Box(L, 0.01 px) rotated), flat sky added as an image (same tilt as scene.py),
noise: galsim.CCDNoise (Poisson + read noise), output uint16 via galsim.fits / astropy.
One process; GalSim draws objects on one core (its OpenMP is for photon shooting and HSM only).
"""
import sys, time; T0 = time.time()
import numpy as np, galsim
from astropy.io import fits
from scene import add_args, make_scene, star_xy, sky_map, outname, PEDESTAL

def main():
    p = add_args(); p.add_argument('--psf', default='gauss'); p.add_argument('--method', default='auto')
    p.add_argument('--stage', action='store_true'); a = p.parse_args()
    s = make_scene(a)
    psf = galsim.Gaussian(fwhm=a.fwhm) if a.psf == 'gauss' else galsim.Moffat(beta=3.5, fwhm=a.fwhm)
    star = psf
    if a.streak > 0:
        star = galsim.Convolve(psf, galsim.Box(a.streak, 0.01).rotate(a.angle*galsim.degrees))
    rng = galsim.BaseDeviate(a.seed)
    def st(name, t):
        if a.stage: print('%-8s %.4f' % (name, time.time()-t), file=sys.stderr)
        return time.time()
    t = st('startup', T0)
    for k in range(a.frames):
        im = galsim.ImageF(sky_map(s, np.float32) + np.float32(a.dark*a.exptime), xmin=0, ymin=0, scale=1.0)
        t = st('skymap', t)
        x, y = star_xy(s, k)
        def put(obj, x, y, f):
            o = obj.withFlux(f)
            stamp = o.drawImage(center=(x, y), scale=1.0, method=a.method,
                                **({'rng': rng} if a.method == 'phot' else {}))
            b = stamp.bounds & im.bounds
            if b.isDefined(): im[b] += stamp[b]
        for i in range(a.stars): put(star, x[i], y[i], s.flux[i])
        put(psf, s.satx, s.saty, s.satflux)
        t = st('stars', t)
        im.addNoise(galsim.CCDNoise(rng, gain=1.0, read_noise=a.read_noise))
        t = st('noise', t)
        adu = np.clip(np.rint(im.array + np.float32(PEDESTAL)), 0, 65535).astype(np.uint16)
        t = st('quant', t)
        fits.PrimaryHDU(adu).writeto(outname(a, k), overwrite=True)
        t = st('fits', t)
main()
