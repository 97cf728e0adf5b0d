"use strict";
// Commands that fly a run again: to show, and to copy.
const Command = (() => {
  let hide = 0;

  function say(text) {
    const box = document.getElementById("copied");
    box.textContent = text;
    box.hidden = false;
    clearTimeout(hide);
    hide = setTimeout(() => (box.hidden = true), 6000);
  }

  // For pages that may not use the clipboard's interface.
  function copySelected(text) {
    const field = element("textarea", { readonly: "", "aria-hidden": "true" });
    field.value = text;
    document.body.append(field);
    field.select();
    const done = document.execCommand("copy");
    field.remove();
    return done;
  }

  async function copy(text) {
    let done = true;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      done = copySelected(text);
    }
    say(done ? `Copied: ${text}` : text);
  }

  addEventListener("click", (event) => {
    const button = event.target.closest("button[data-command]");
    if (button) copy(button.dataset.command);
  });

  // The command of a run that is shown by itself.
  function of(report, variant, seed) {
    const { prefix, rest } = report.commands[variant];
    return prefix + rest[seed];
  }

  return { copy, of };
})();
