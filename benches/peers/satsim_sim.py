"""SatSim (pip install satsim, CPU tensorflow).

Usage: venv-satsim/bin/python satsim_sim.py --side 4096 --stars 2000 --streak 0 --frames 1 --seed 1 --out out/o.fits
   --mode fftconv2p|epsf    renderer (SatSim's default is fftconv2p; epsf is its faster, 'experimental' one)
   --osf 3                  spatial oversampling (SatSim's examples use 3)
   --render-size 0          0 = full frame at once, else tile side (SatSim's way to bound memory)
   --star-render transform|streak
   --extras                 keep SatSim's default products (annotated JPEG, movie, CZML)
   --threads N              tensorflow intra/inter-op threads (0 = default)
The catalogue is passed as SatSim's 'csv' star mode, pixel positions mapped to RA/Dec by SatSim's own WCS.
SatSim offers no seed for the frame noise; this script calls tf.random.set_seed + np.random.seed itself.
"""
import os, sys, time, glob, shutil, math; T0 = time.time()
os.environ.setdefault('TF_CPP_MIN_LOG_LEVEL', '3'); os.environ['CUDA_VISIBLE_DEVICES'] = ''
import numpy as np
from scene import add_args, make_scene, star_xy, outname, ZP, TILT_X, TILT_Y, PEDESTAL, PIXSCALE
p = add_args(); p.add_argument('--mode', default='fftconv2p'); p.add_argument('--osf', type=int, default=3)
p.add_argument('--render-size', type=int, default=0); p.add_argument('--star-render', default='')
p.add_argument('--extras', action='store_true'); p.add_argument('--threads', type=int, default=0)
p.add_argument('--stage', action='store_true'); p.add_argument('--kernel', type=int, default=0)
p.add_argument('--padding', type=int, default=0)
a = p.parse_args(); s = make_scene(a)
import tensorflow as tf
if a.threads:
    tf.config.threading.set_intra_op_parallelism_threads(a.threads); tf.config.threading.set_inter_op_parallelism_threads(a.threads)
from satsim import gen_multi
from satsim.geometry.wcs import get_min_max_ra_dec
tf.random.set_seed(a.seed); np.random.seed(a.seed)
if a.stage: print('startup %.3f' % (time.time()-T0), file=sys.stderr)
from scipy.special import erf
pad = a.padding or int(max(16, math.ceil(a.streak*1.1+16)))
eod = float(erf(1/(2*math.sqrt(2)*s.sigma))**2)
fov = a.side*PIXSCALE/3600
H = (a.side+2*pad)*a.osf
fovp = H*(fov/a.side/a.osf)
work = a.out + '.satsim'; shutil.rmtree(work, ignore_errors=True); os.makedirs(work)
ra0, dec0 = 180.0, 0.0
_, _, w = get_min_max_ra_dec(H, H, fovp/H, fovp/H, ra0, dec0, 0, 0, 'center')
# satsim position (oversampled, padded): r_os = (y + 0.5 + pad)*osf - 0.5 ; mid-exposure, so start half a streak back
x, y = s.x - s.dx/2, s.y - s.dy/2
cc = (x + 0.5 + pad)*a.osf - 0.5; rr = (y + 0.5 + pad)*a.osf - 0.5
ra, dec = w.wcs_pix2world(cc - H/2, rr - H/2, 0)
cat = os.path.join(work, 'cat.csv')
with open(cat, 'w') as f:
    for i in range(a.stars): f.write('%d,%.6f,%.10f,%.10f\n' % (i, s.mag[i], ra[i], dec[i]))
tilt = {'$function': 'polygrid2d', 'module': 'satsim.image.model',
        'kwargs': {'height': a.side, 'width': a.side, 'c': [[a.sky, a.sky*TILT_X], [a.sky*TILT_Y, 0.0]]}}
tilt['kwargs']['c'] = [[a.sky/a.exptime, a.sky*TILT_X/a.exptime], [a.sky*TILT_Y/a.exptime, 0.0]]
sim = dict(mode=a.mode, spacial_osf=a.osf, temporal_osf=max(1, int(math.ceil(a.streak*2))), padding=pad, samples=1,
           star_render_mode=a.star_render or ('streak' if a.streak > 0 and a.mode == 'epsf' else 'transform'),
           star_catalog_query_mode='at_start', apply_star_wrap_around=False,
           save_jpeg=a.extras, save_movie=a.extras, save_czml=a.extras, save_ground_truth=False, calculate_snr=a.extras)
if a.render_size: sim['render_size'] = [a.render_size, a.render_size]
if a.mode == 'epsf': sim['epsf'] = dict(kernel_size=a.kernel or (15 + 2*int(math.ceil(a.streak/2))))
cfg = dict(version=1, sim=sim,
  fpa=dict(height=a.side, width=a.side, y_fov=fov, x_fov=fov, dark_current=a.dark, gain=1, bias=0, zeropoint=ZP,
           a2d=dict(response='linear', fwc=1e6, gain=1.0, bias=PEDESTAL), noise=dict(read=a.read_noise, electronic=0),
           psf=dict(mode='gaussian', eod=eod), time=dict(exposure=a.exptime, gap=0.1*a.exptime), num_frames=a.frames),
  background=dict(stray=tilt, galactic=60.0),
  geometry=dict(stars=dict(mode='csv', path=cat, ra=ra0, dec=dec0, rotation=0, pad=0.0,
                           motion=dict(mode='affine' if a.streak > 0 else 'none', rotation=0.0, translation=[s.dy/a.exptime, s.dx/a.exptime])),
                obs=dict(mode='list', list=[dict(mode='line', origin=[(s.saty+0.5)/a.side, (s.satx+0.5)/a.side], velocity=[0.0, 0.0], mv=s.satmag)])))
t = time.time()
gen_multi(cfg, output_dir=work, folder_name='set')
if a.stage: print('gen_multi %.3f' % (time.time()-t), file=sys.stderr)
ff = sorted(glob.glob(work + '/set/ImageFiles/*.fits'))
for k, f in enumerate(ff): os.replace(f, outname(a, k))
shutil.rmtree(work)
