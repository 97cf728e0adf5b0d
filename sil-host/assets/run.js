"use strict";
// The replay of the page of one flight.
addEventListener("DOMContentLoaded", () => {
  const { name, track } = JSON.parse(document.getElementById("data").textContent);
  if (track.time.length === 0) return;
  new Player(document.getElementById("replay"), [{ name, record: track }]);
});
