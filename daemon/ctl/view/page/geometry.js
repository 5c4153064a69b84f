// Vectors, rotations and the camera of the scene. Pure: numbers in, numbers out.
// T_A_B is the pose of B in A. Quaternions are Hamilton, w x y z. Matrices are lists of rows.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (s, a) => [s * a[0], s * a[1], s * a[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const norm = (a) => Math.sqrt(dot(a, a));
export const unit = (a) => scale(1 / norm(a), a);
export const times = (M, v) => [dot(M[0], v), dot(M[1], v), dot(M[2], v)];
export const transposed = (M) => [0, 1, 2].map((j) => [M[0][j], M[1][j], M[2][j]]);
export const product = (A, B) => {
  const columns = transposed(B);
  return A.map((row) => columns.map((column) => dot(row, column)));
};
/** M P M^T: a covariance in other axes. */
export const turned = (M, P) => product(product(M, P), transposed(M));

/** R(q) of a unit quaternion. */
export function rotationOf([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

/** R_L_B of the level frame L: z against gravity, x where the body's x points, seen from above. */
export function levelOf(up) {
  const z = unit(up);
  // A robot that stands on its tail still has a y axis.
  const vertical = Math.abs(z[0]) > 0.999;
  const y = unit(vertical ? [0, 1, 0] : cross(z, [1, 0, 0]));
  const x = cross(y, z);
  return [x, cross(z, x), z];
}

/** Roll, pitch, yaw [rad] of a rotation, z-y-x. */
export function anglesOf(R) {
  return [
    Math.atan2(R[2][1], R[2][2]),
    Math.asin(Math.max(-1, Math.min(1, -R[2][0]))),
    Math.atan2(R[1][0], R[0][0]),
  ];
}

/** The angle between two rotations [rad]. */
export function angleBetween(A, B) {
  const trace = product(transposed(A), B).reduce((sum, row, i) => sum + row[i], 0);
  return Math.acos(Math.max(-1, Math.min(1, (trace - 1) / 2)));
}

/** Azimuth, from x towards y, and elevation of a direction [rad]. */
export const headingOf = (v) => [Math.atan2(v[1], v[0]), Math.atan2(v[2], Math.hypot(v[0], v[1]))];

/** The angle between two directions [rad]. */
export const angleOf = (a, b) => Math.atan2(norm(cross(a, b)), dot(a, b));

/** The unit direction that differs from `now` by the azimuth and elevation by which `measured` differed from `expected`. */
export function carried(measured, expected, now) {
  const [m, e, n] = [measured, expected, now].map(headingOf);
  const [azimuth, elevation] = [n[0] + m[0] - e[0], n[1] + m[1] - e[1]];
  return [Math.cos(azimuth) * Math.cos(elevation), Math.sin(azimuth) * Math.cos(elevation), Math.sin(elevation)];
}

/** A perspective camera that orbits `target`. Its axes are x right, y down, z forward. */
export class Camera {
  constructor() {
    this.target = [0, 0, 0];
    this.azimuth = 0; // of the line of sight, from x towards y [rad]
    this.elevation = 0.6; // above the horizon [rad]
    this.distance = 10; // from the target [m]
    this.resize(1, 1);
  }

  resize(width, height) {
    this.width = width;
    this.height = height;
    this.focal = 0.9 * Math.min(width, 1.6 * height); // [px]
  }

  /** R_C_L and the camera's place; call it before a picture. */
  update() {
    const [ca, sa] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [ce, se] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    const forward = [ca * ce, sa * ce, -se];
    const right = [sa, -ca, 0];
    this.R = [right, cross(forward, right), forward];
    this.place = sub(this.target, scale(this.distance, forward));
  }

  /** The point in the camera's axes [m]. */
  see(p) {
    return times(this.R, sub(p, this.place));
  }

  /** Pixels of a point that is seen at `c`; c[2] must be positive. */
  pixel(c) {
    return [
      this.width / 2 + (this.focal * c[0]) / c[2],
      this.height / 2 + (this.focal * c[1]) / c[2],
    ];
  }

  /** The part of a segment before the camera, as pixels; null if there is none. */
  segment(p, q) {
    const near = 0.05;
    let [a, b] = [this.see(p), this.see(q)];
    if (a[2] < near && b[2] < near) return null;
    const cut = (from, to) => add(from, scale((near - from[2]) / (to[2] - from[2]), sub(to, from)));
    if (a[2] < near) a = cut(a, b);
    else if (b[2] < near) b = cut(b, a);
    return [this.pixel(a), this.pixel(b)];
  }

  /**
   * The outline of the ellipsoid (x - p)^T (k^2 P)^-1 (x - p) = 1, an ellipse {x, y, a, b, angle} in
   * pixels; null where the camera is inside or beside it. The dual conic of the outline is
   * C* = K (c c^T - A) K^T, with c and A the ellipsoid in the camera's axes (Hartley and Zisserman,
   * Multiple View Geometry, 2nd ed., eq. 8.7).
   */
  ellipse(p, P, k) {
    const c = this.see(p);
    const A = turned(this.R, P).map((row) => row.map((x) => k * k * x));
    const C = (i, j) => c[i] * c[j] - A[i][j];
    if (c[2] <= 0 || C(2, 2) <= 0) return null;
    const [mx, my] = [C(0, 2) / C(2, 2), C(1, 2) / C(2, 2)];
    const xx = mx * mx - C(0, 0) / C(2, 2);
    const xy = mx * my - C(0, 1) / C(2, 2);
    const yy = my * my - C(1, 1) / C(2, 2);
    const [mean, half] = [(xx + yy) / 2, Math.hypot((xx - yy) / 2, xy)];
    if (!(mean - half > 0)) return null;
    return {
      x: this.width / 2 + this.focal * mx,
      y: this.height / 2 + this.focal * my,
      a: this.focal * Math.sqrt(mean + half),
      b: this.focal * Math.sqrt(mean - half),
      angle: 0.5 * Math.atan2(2 * xy, xx - yy),
    };
  }
}
