"use strict";
// A recorded flight: columns of frames, read at any time in between.
class RecordedFlight {
  constructor(record) {
    this.record = record;
    this.time = record.time;
    this.duration = record.time[record.time.length - 1];
    this.error = record.time.map((_, frame) =>
      Math.hypot(...[0, 1, 2].map((i) => record.position[i][frame] - record.reference[i][frame])),
    );
    this.tilt = record.tilt_error.map((angle) => (angle * 180) / Math.PI);
    this.thrustMax = Math.max(1e-9, ...record.thrust);
  }

  vector(columns, frame) {
    return columns.map((column) => column[frame]);
  }

  // Number of the last frame at or before `time`.
  frameAt(time) {
    let [low, high] = [0, this.time.length - 1];
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (this.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  // The vehicle at `time`, between the two frames around it.
  at(time) {
    const { record } = this;
    const frame = this.frameAt(time);
    const next = Math.min(frame + 1, this.time.length - 1);
    const span = this.time[next] - this.time[frame];
    const share = span > 0 ? Math.min(1, (time - this.time[frame]) / span) : 0;
    const mix = (column) => column[frame] + (column[next] - column[frame]) * share;
    return {
      frame,
      position: record.position.map(mix),
      reference: record.reference.map(mix),
      attitude: Rotation.between(this.vector(record.attitude, frame), this.vector(record.attitude, next), share),
      thrust: mix(record.thrust),
      error: mix(this.error),
      tilt: mix(this.tilt),
    };
  }

  // Centre and radius of a ball around everything that is shown.
  ball() {
    const both = [0, 1, 2].map((i) => [...this.record.position[i], ...this.record.reference[i]]);
    const ends = both.map((values) => [Math.min(...values), Math.max(...values)]);
    const centre = ends.map(([low, high]) => (low + high) / 2);
    return { centre, radius: Math.max(1, Math.hypot(...ends.map(([low, high]) => high - low)) / 2) };
  }
}
