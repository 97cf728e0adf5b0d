"use strict";
// Vectors as [x, y, z], unit quaternions as [w, x, y, z] that take body to world coordinates.
const Rotation = {
  apply([w, x, y, z], [a, b, c]) {
    const [u, v, t] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
    return [a + w * u + y * t - z * v, b + w * v + z * u - x * t, c + w * t + x * v - y * u];
  },

  // The shorter way from `p` to `q`, normalised linear: frames are close to each other.
  between(p, q, share) {
    const sign = p.reduce((sum, value, i) => sum + value * q[i], 0) < 0 ? -1 : 1;
    const mixed = p.map((value, i) => value + (sign * q[i] - value) * share);
    const length = Math.hypot(...mixed) || 1;
    return mixed.map((value) => value / length);
  },
};
