"use strict";
// What the replay shows: ground, ways flown and wanted, vehicle with axes, rotors and thrust.
const Scene = (() => {
  const ROTORS = [45, 135, 225, 315].map((degrees) => (degrees * Math.PI) / 180);
  const RIM = Array.from({ length: 21 }, (_, i) => (i * Math.PI) / 10);
  // The vehicle is drawn this large at least, as a share of the camera's distance.
  const SIZE_MIN = 0.075;
  const ARM = 0.25;

  function stroke(context, colour, width, dash = []) {
    context.strokeStyle = Theme.colour(colour);
    context.lineWidth = width;
    context.setLineDash(dash);
  }

  function line(context, camera, from, to) {
    const ends = camera.segment(from, to);
    if (!ends) return;
    context.beginPath();
    context.moveTo(...ends[0]);
    context.lineTo(...ends[1]);
    context.stroke();
  }

  // A line through frames `[first, last]` of three columns, and on to `end`.
  function way(context, camera, columns, first, last, end) {
    context.beginPath();
    let before = null;
    const visit = (point) => {
      const ends = before && camera.segment(before, point);
      if (ends) {
        context.moveTo(...ends[0]);
        context.lineTo(...ends[1]);
      }
      before = point;
    };
    for (let frame = first; frame <= last; frame++) visit(columns.map((column) => column[frame]));
    if (end) visit(end);
    context.stroke();
  }

  // A power of ten times 1, 2 or 5 near `length`.
  function round(length) {
    const power = Math.pow(10, Math.floor(Math.log10(length)));
    return [5, 2, 1].find((factor) => factor * power <= length) * power;
  }

  // A square of lines below everything, around the camera's target.
  function ground(context, camera, height) {
    const cell = round(camera.distance / 4);
    const reach = 8;
    const [x, y] = [0, 1].map((i) => Math.round(camera.target[i] / cell) * cell);
    stroke(context, "--grid", 1);
    for (let i = -reach; i <= reach; i++) {
      line(context, camera, [x + i * cell, y - reach * cell, height], [x + i * cell, y + reach * cell, height]);
      line(context, camera, [x - reach * cell, y + i * cell, height], [x + reach * cell, y + i * cell, height]);
    }
    return cell;
  }

  function arrow(context, camera, from, to) {
    const ends = camera.segment(from, to);
    if (!ends) return;
    const [[x, y], [u, v]] = ends;
    const angle = Math.atan2(v - y, u - x);
    const head = Math.min(9, 0.5 * Math.hypot(u - x, v - y));
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(u, v);
    for (const side of [-0.45, 0.45]) {
      context.moveTo(u, v);
      context.lineTo(u - head * Math.cos(angle + side), v - head * Math.sin(angle + side));
    }
    context.stroke();
  }

  function label(context, camera, point, text, colour) {
    const at = camera.project(point);
    if (!at) return;
    context.font = "bold 12px Helvetica, Arial, sans-serif";
    context.fillStyle = Theme.colour(colour);
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(text, ...at);
  }

  function vehicle(context, camera, now, thrustMax) {
    const size = Math.max(ARM, SIZE_MIN * camera.distance);
    const place = (body) => Rotation.apply(now.attitude, body).map((value, i) => now.position[i] + size * value);
    const hubs = ROTORS.map((angle) => [Math.cos(angle), Math.sin(angle), 0]);
    const far = (body) => camera.eye(place(body))[2];
    context.lineCap = "round";
    stroke(context, "--body", 3);
    hubs.forEach((hub) => line(context, camera, now.position, place(hub)));
    for (const hub of [...hubs].sort((a, b) => far(b) - far(a))) {
      const rim = RIM.map((angle) =>
        camera.project(place([hub[0] + 0.5 * Math.cos(angle), hub[1] + 0.5 * Math.sin(angle), 0.08])),
      );
      if (rim.includes(null)) continue;
      context.beginPath();
      rim.forEach((point) => context.lineTo(...point));
      context.closePath();
      context.globalAlpha = 0.35;
      context.fillStyle = Theme.colour("--rotor");
      context.fill();
      context.globalAlpha = 1;
      stroke(context, "--rotor", 1.2);
      context.stroke();
    }
    const axes = ["x", "y", "z"].map((name, i) => ({ name, tip: [0, 1, 2].map((j) => (i === j ? 1.9 : 0)) }));
    for (const { name, tip } of axes.sort((a, b) => far(b.tip) - far(a.tip))) {
      stroke(context, `--axis-${name}`, 2);
      arrow(context, camera, now.position, place(tip));
      label(context, camera, place(tip.map((value) => 1.2 * value)), name, `--axis-${name}`);
    }
    stroke(context, "--thrust", 4);
    context.globalAlpha = 0.85;
    arrow(context, camera, place([0, 0, 0.1]), place([0, 0, 0.1 + (3.2 * now.thrust) / thrustMax]));
    context.globalAlpha = 1;
  }

  function target(context, camera, now) {
    stroke(context, "--reference", 1.5, [4, 4]);
    line(context, camera, now.position, now.reference);
    const at = camera.project(now.reference);
    if (!at) return;
    stroke(context, "--reference", 2.5);
    context.beginPath();
    context.arc(...at, 7, 0, 2 * Math.PI);
    context.stroke();
  }

  function legend(context, width, height, cell) {
    const entries = [
      ["--trail", [], "flown"],
      ["--reference", [6, 4], "reference"],
      ["--thrust", [], "thrust"],
    ];
    context.font = "12px Helvetica, Arial, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "middle";
    let x = 12;
    for (const [colour, dash, text] of entries) {
      stroke(context, colour, 2.5, dash);
      context.beginPath();
      context.moveTo(x, height - 14);
      context.lineTo(x + 20, height - 14);
      context.stroke();
      context.fillStyle = Theme.colour("--muted");
      context.fillText(text, x + 26, height - 14);
      x += 38 + context.measureText(text).width;
    }
    context.textAlign = "right";
    context.fillText(`grid ${numberText(cell)} m`, width - 12, height - 14);
  }

  // Draws the flight at `now` on a canvas of `width` by `height` pixels.
  return function (context, camera, flight, now, ground_height, width, height) {
    const { position, reference, time } = flight.record;
    context.clearRect(0, 0, width, height);
    camera.look(width, height);
    const cell = ground(context, camera, ground_height);
    stroke(context, "--reference", 1.5, [6, 4]);
    way(context, camera, reference, 0, time.length - 1);
    stroke(context, "--trail", 1);
    context.globalAlpha = 0.25;
    way(context, camera, position, now.frame, time.length - 1);
    context.globalAlpha = 1;
    stroke(context, "--trail", 2);
    way(context, camera, position, 0, now.frame, now.position);
    target(context, camera, now);
    vehicle(context, camera, now, flight.thrustMax);
    legend(context, width, height, cell);
  };
})();
