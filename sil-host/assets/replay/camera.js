"use strict";
// A camera on a sphere around a target, z up, with perspective.
class Camera {
  constructor() {
    this.azimuth = -0.9;
    this.elevation = 0.35;
    this.distance = 8;
    this.target = [0, 0, 0];
  }

  orbit(right, up) {
    this.azimuth -= right;
    this.elevation = Math.max(-1.5, Math.min(1.5, this.elevation + up));
  }

  zoom(factor) {
    this.distance = Math.max(1, Math.min(5000, this.distance * factor));
  }

  // Prepares for a canvas of `width` by `height` pixels.
  look(width, height) {
    const [ca, sa] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [ce, se] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    this.right = [-sa, ca, 0];
    this.up = [-se * ca, -se * sa, ce];
    this.back = [ce * ca, ce * sa, se];
    this.centre = [width / 2, height / 2];
    this.focal = 1.3 * Math.min(width, height);
    this.near = 0.05 * this.distance;
  }

  // Coordinates along right, up and away from the camera.
  eye(point) {
    const from = point.map((value, i) => value - this.target[i]);
    const dot = (axis) => from[0] * axis[0] + from[1] * axis[1] + from[2] * axis[2];
    return [dot(this.right), dot(this.up), this.distance - dot(this.back)];
  }

  pixel([x, y, depth]) {
    return [this.centre[0] + (this.focal * x) / depth, this.centre[1] - (this.focal * y) / depth];
  }

  // Where a point is on the canvas; null behind the camera.
  project(point) {
    const eye = this.eye(point);
    return eye[2] < this.near ? null : this.pixel(eye);
  }

  // Both ends of a line on the canvas, cut where it passes behind the camera; null if all of it does.
  segment(from, to) {
    let [a, b] = [this.eye(from), this.eye(to)];
    if (a[2] < this.near && b[2] < this.near) return null;
    const cut = (front, behind) => {
      const share = (front[2] - this.near) / (front[2] - behind[2]);
      return front.map((value, i) => value + (behind[i] - value) * share);
    };
    if (a[2] < this.near) a = cut(b, a);
    if (b[2] < this.near) b = cut(a, b);
    return [this.pixel(a), this.pixel(b)];
  }
}
