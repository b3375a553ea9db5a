// Numbers as text.

/** Rounds to significant digits, without an exponent where that is readable. */
export function short(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${mantissa.replace("-", "−")} × 10${superscript(Number(exponent))}`;
  }
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return value.toFixed(decimals).replace("-", "−");
}

const superscript = (n) => String(n).replace(/[-\d]/g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]));

/** Next number of two significant digits. */
export function roundUp(value) {
  if (!(value > 0)) return 0;
  const power = 10 ** (Math.floor(Math.log10(value)) - 1);
  return Number((Math.ceil(value / power - 1e-6) * power).toPrecision(6));
}

/** Rounded number without zeros at its end. */
export function plain(value, digits = 3) {
  return short(value, digits).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
}

/** Power of ten in which an axis up to `size` is labelled, and its name. */
export function axisFactor(size) {
  if (!(size > 0) || (size >= 1e-2 && size < 1e4)) return [1, ""];
  const exponent = Math.floor(Math.log10(size));
  return [10 ** exponent, ` × 10${superscript(-exponent)}`];
}

/** Unit of length for a size [m], and metres in it. */
export function lengthUnit(size) {
  if (size < 2e-3) return ["µm", 1e-6];
  return size < 2 ? ["mm", 1e-3] : ["m", 1];
}

/** Time with the decimals that a duration needs. */
export function seconds(time, duration) {
  const decimals = Math.max(2, Math.min(7, 3 - Math.floor(Math.log10(duration || 1))));
  return time.toFixed(Math.min(decimals, 5));
}

/** About `count` round numbers from low to high. */
export function ticks(low, high, count) {
  const raw = (high - low) / Math.max(1, count);
  if (!(raw > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].map((f) => f * power).find((s) => s >= raw * 0.999);
  const list = [];
  for (let v = Math.ceil(low / step - 1e-9); v * step <= high + 1e-9 * step; v++) {
    list.push(Number((v * step).toPrecision(12)));
  }
  return list;
}
