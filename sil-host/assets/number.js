"use strict";
// Numbers as text: so many significant digits, no padding, a dash for none.
function numberText(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const magnitude = Math.abs(value);
  if (magnitude !== 0 && (magnitude < 1e-3 || magnitude >= 1e6)) {
    return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
  }
  return String(Number(value.toPrecision(digits)));
}

// `name [unit]`; a margin is called after what it is a margin of.
function labelText(quantity) {
  const name = quantity.kind === "margin" ? `margin: ${quantity.name}` : quantity.name;
  return quantity.unit && quantity.unit !== "-" ? `${name} [${quantity.unit}]` : name;
}
