"use strict";
// Mouse, touch and keys that move the camera of a canvas; `changed` is called after each.
function orbitByHand(canvas, camera, changed) {
  const held = new Map();
  const spread = () => {
    const [a, b] = [...held.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    const apart = held.size === 2 ? spread() : 0;
    held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (held.size === 2) camera.zoom(apart / Math.max(1, spread()));
    else camera.orbit((event.clientX - before.x) * 0.008, (event.clientY - before.y) * 0.008);
    changed();
  });
  const release = (event) => held.delete(event.pointerId);
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);

  // The wheel moves the page until the reader has taken hold of the picture.
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    camera.zoom(Math.exp(0.0015 * event.deltaY));
    changed();
  }, { passive: false });

  const keys = {
    ArrowLeft: () => camera.orbit(-0.1, 0),
    ArrowRight: () => camera.orbit(0.1, 0),
    ArrowUp: () => camera.orbit(0, 0.1),
    ArrowDown: () => camera.orbit(0, -0.1),
    "+": () => camera.zoom(0.85),
    "=": () => camera.zoom(0.85),
    "-": () => camera.zoom(1 / 0.85),
  };
  canvas.addEventListener("keydown", (event) => {
    const move = keys[event.key];
    if (!move) return;
    event.preventDefault();
    move();
    changed();
  });
}
