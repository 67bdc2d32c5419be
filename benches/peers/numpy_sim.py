"""the plain numpy/scipy/astropy script a student would write.

Usage: venv-np/bin/python numpy_sim.py --side 4096 --stars 2000 --streak 0 --frames 1 --seed 1 --out out/o.fits
   --rng poisson   numpy Generator.poisson on the float64 map (default)
   --rng gauss     Gaussian approximation mean + sqrt(mean)*N(0,1), float32 (the usual 'fast' shortcut)
   --stage         print wall seconds per stage and frame on stderr
Stars are pixel-integrated Gaussians (erf), stamps of +-6 sigma; a streak is that PSF convolved with a
line, by sampling the line every 0.5 px.
"""
import sys, time; T0 = time.time()
import numpy as np
from scipy.special import erf
from astropy.io import fits
from scene import add_args, make_scene, star_xy, sky_map, outname, PEDESTAL

def add_psf(m, x, y, flux, sigma, h):
    n = m.shape[0]
    ix, iy = int(round(x)), int(round(y))
    x0, x1, y0, y1 = max(ix-h, 0), min(ix+h+1, n), max(iy-h, 0), min(iy+h+1, n)
    if x0 >= x1 or y0 >= y1: return
    c = 1/(np.sqrt(2)*sigma)
    ex = np.diff(erf((np.arange(x0, x1+1)-0.5-x)*c))*0.5
    ey = np.diff(erf((np.arange(y0, y1+1)-0.5-y)*c))*0.5
    m[y0:y1, x0:x1] += flux*ey[:, None]*ex[None, :]

def add_streak(m, x, y, dx, dy, flux, sigma, h):
    n = m.shape[0]
    L = np.hypot(dx, dy); k = max(int(np.ceil(L/0.5)), 1)
    t = (np.arange(k)+0.5)/k - 0.5
    xs, ys = x+t*dx, y+t*dy
    x0, x1 = max(int(xs.min())-h, 0), min(int(xs.max())+h+2, n)
    y0, y1 = max(int(ys.min())-h, 0), min(int(ys.max())+h+2, n)
    if x0 >= x1 or y0 >= y1: return
    c = 1/(np.sqrt(2)*sigma)
    ex = np.diff(erf((np.arange(x0, x1+1)-0.5-xs[:, None])*c), axis=1)*0.5
    ey = np.diff(erf((np.arange(y0, y1+1)-0.5-ys[:, None])*c), axis=1)*0.5
    m[y0:y1, x0:x1] += (flux/k)*(ey.T @ ex)

def main():
    p = add_args(); p.add_argument('--rng', default='poisson', choices=['poisson', 'gauss'])
    p.add_argument('--stage', action='store_true'); a = p.parse_args()
    s = make_scene(a); h = int(np.ceil(6*s.sigma))
    rng = np.random.default_rng(a.seed)
    def st(name, t):
        if a.stage: print('%-8s %.4f' % (name, time.time()-t), file=sys.stderr)
        return time.time()
    t = st('startup', T0)
    for k in range(a.frames):
        dt = np.float64 if a.rng == 'poisson' else np.float32
        m = sky_map(s, dt) ; m += a.dark*a.exptime
        t = st('skymap', t)
        x, y = star_xy(s, k)
        for i in range(a.stars):
            if a.streak > 0: add_streak(m, x[i], y[i], s.dx, s.dy, s.flux[i], s.sigma, h)
            else: add_psf(m, x[i], y[i], s.flux[i], s.sigma, h)
        add_psf(m, s.satx, s.saty, s.satflux, s.sigma, h)
        t = st('stars', t)
        if a.rng == 'poisson':
            img = rng.poisson(m).astype(np.float64); t = st('poisson', t)
            img += rng.normal(0, a.read_noise, m.shape)
        else:
            img = m + np.sqrt(m)*rng.standard_normal(m.shape, dtype=np.float32); t = st('poisson', t)
            img += np.float32(a.read_noise)*rng.standard_normal(m.shape, dtype=np.float32)
        t = st('read', t)
        img += PEDESTAL
        adu = np.clip(np.rint(img), 0, 65535).astype(np.uint16)
        t = st('quant', t)
        fits.PrimaryHDU(adu).writeto(outname(a, k), overwrite=True)
        t = st('fits', t)
main()
