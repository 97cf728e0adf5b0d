"use strict";
// The replay and the figures of the page of one flight.
addEventListener("DOMContentLoaded", () => {
  const { name, track, figures } = JSON.parse(document.getElementById("data").textContent);
  if (track.time.length > 0) new Player(document.getElementById("replay"), [{ name, record: track }]);
  const section = document.getElementById("figures");
  figures.forEach((figure) => Figure(section, figure));
});
