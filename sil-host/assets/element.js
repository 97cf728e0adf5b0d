"use strict";
// An HTML element with properties and children; `text` sets its text.
function element(tag, properties = {}, children = []) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "text") made.textContent = value;
    else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

// A labelled drop-down list of `[value, label, group]`; `changed` gets the value.
function dropDown(label, entries, selected, changed) {
  const select = element("select", { onchange: () => changed(select.value) });
  const groups = new Map();
  for (const [value, text, group] of entries) {
    if (group && !groups.has(group)) {
      groups.set(group, select.appendChild(element("optgroup", { label: group })));
    }
    (groups.get(group) || select).append(element("option", { value, text }));
  }
  select.value = selected;
  return element("label", {}, [label, select]);
}
