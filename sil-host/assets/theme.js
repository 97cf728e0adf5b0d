"use strict";
// Light or dark: what the system prefers, until the reader chooses; always light on paper.
const Theme = (() => {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const listeners = [];
  let chosen = null;
  let printing = false;

  function name() {
    if (printing) return "light";
    return chosen || (dark.matches ? "dark" : "light");
  }

  function apply() {
    document.documentElement.dataset.theme = name();
    const button = document.getElementById("theme");
    if (button) button.textContent = name() === "dark" ? "Light theme" : "Dark theme";
    listeners.forEach((listener) => listener());
  }

  function toggle() {
    chosen = name() === "dark" ? "light" : "dark";
    apply();
  }

  function onPrint(now) {
    printing = now;
    apply();
  }

  dark.addEventListener("change", apply);
  addEventListener("beforeprint", () => onPrint(true));
  addEventListener("afterprint", () => onPrint(false));
  addEventListener("DOMContentLoaded", () => {
    document.getElementById("theme").addEventListener("click", toggle);
    apply();
  });
  apply();

  return {
    // The value of a custom property of the style sheet, as in `--text`.
    colour: (property) => getComputedStyle(document.documentElement).getPropertyValue(property).trim(),
    // Calls `listener` whenever the colours change.
    onChange: (listener) => listeners.push(listener),
  };
})();
