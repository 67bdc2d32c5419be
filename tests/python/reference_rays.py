"""Light curves of boxes by plain ray casting, as an independent check of the inversion's renderer.

Every lit and seen face is covered by a regular grid of points; a point counts if the rays to the Sun and to the observer meet no other
box (slab method) and if it is inside none. Lambert's law with albedo RHO. Nothing here is shared with the Rust code.

    python rays.py > rays.csv
"""
import numpy as np

RHO = 0.5
GRID = 400
BOXES = [  # centre, half sizes, along the axes of the matrix AXES below: an L with arms 1 m wide, 0.8 m thick
    (np.array([0.0, -0.5, 0.0]), np.array([1.0, 0.5, 0.4])),
    (np.array([-0.5, 0.5, 0.0]), np.array([0.5, 0.5, 0.4])),
]
TURN, AXIS = 0.9, np.array([2.0, -1.0, 2.0]) / 3.0


def rotation(axis, angle):
    x = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * x + (1 - np.cos(angle)) * x @ x


AXES = rotation(AXIS, TURN)


def meets(points, direction, centre, half):
    """Whether the ray from each point along direction meets the box beyond rounding."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low = (centre - half - points) / direction
        high = (centre + half - points) / direction
    near = np.minimum(low, high).max(axis=1)
    far = np.maximum(low, high).min(axis=1)
    return far > np.maximum(near, 0.0) + 1e-9


def flux(sun, observer, boxes=BOXES):
    s, o = AXES.T @ sun, AXES.T @ observer
    grid = (np.arange(GRID) + 0.5) / GRID * 2 - 1
    total = 0.0
    for number, (centre, half) in enumerate(boxes):
        for axis in range(3):
            for sign in (-1.0, 1.0):
                cs, co = sign * s[axis], sign * o[axis]
                if cs <= 0 or co <= 0:
                    continue
                u, v = (axis + 1) % 3, (axis + 2) % 3
                a, b = np.meshgrid(grid * half[u], grid * half[v])
                points = np.zeros((GRID * GRID, 3))
                points[:, axis] = sign * half[axis]
                points[:, u], points[:, v] = a.ravel(), b.ravel()
                points += centre
                open_ = np.ones(len(points), bool)
                for other, (c, h) in enumerate(boxes):
                    if other != number:
                        open_ &= ~meets(points, s, c, h) & ~meets(points, o, c, h)
                total += RHO / np.pi * cs * co * 4 * half[u] * half[v] * open_.mean()
    return total


def main():
    rng = np.random.default_rng(20)
    print("sun_x,sun_y,sun_z,observer_x,observer_y,observer_z,flux")
    for phase in np.repeat(np.radians([50.0, 90.0]), 60):
        sun = rng.normal(size=3)
        sun /= np.linalg.norm(sun)
        across = np.cross(sun, rng.normal(size=3))
        across /= np.linalg.norm(across)
        observer = np.cos(phase) * sun + np.sin(phase) * across
        print(",".join(f"{v:.12f}" for v in (*sun, *observer, flux(sun, observer))))


if __name__ == "__main__":
    main()
