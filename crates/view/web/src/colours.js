// Colours of grains and colour maps for both themes.

/** Converts Oklab lightness, chroma and hue [deg] to sRGB bytes. */
function fromOklch(lightness, chroma, hue) {
  const a = chroma * Math.cos((hue * Math.PI) / 180);
  const b = chroma * Math.sin((hue * Math.PI) / 180);
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const linear = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
  return linear.map((v) => {
    const c = Math.min(1, Math.max(0, v));
    return Math.round(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055));
  });
}

function map(colour) {
  const bytes = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; i++) bytes.set([...colour(i / 255), 255], 4 * i);
  return bytes;
}

const fromTriples = (triples) => map((s) => triples.subarray(3 * Math.round(255 * s)).slice(0, 3));

/** Maps of a dark page: near the background at zero, light at the ends. */
const DARK = {
  magnitude: map((s) => fromOklch(0.235 + 0.66 * s, 0.03 + 0.13 * Math.sin(Math.PI * s ** 0.8), 268 - 178 * s)),
  signed: map((s) => {
    const size = Math.abs(2 * s - 1);
    // Zero has the colour of the page: a trace of blue fades into the hue of the end.
    const [hue, rest] = [((s < 0.5 ? 250 : 38) * Math.PI) / 180, 0.022 * (1 - size) ** 2];
    const chroma = 0.15 * size ** 0.9;
    const a = chroma * Math.cos(hue) + rest * Math.cos(4.6);
    const b = chroma * Math.sin(hue) + rest * Math.sin(4.6);
    return fromOklch(0.225 + 0.53 * size, Math.hypot(a, b), (Math.atan2(b, a) * 180) / Math.PI);
  }),
};

/** Map of grains by a quantity, legible on both pages. */
export const GRAIN_MAP = map((s) => fromOklch(0.42 + 0.46 * s, 0.13, 285 - 195 * s));

export class Colours {
  constructor(index) {
    this.grains = index.colours;
    this.light = { magnitude: fromTriples(index.magnitude), signed: fromTriples(index.signed) };
    this.query = matchMedia("(prefers-color-scheme: dark)");
    this.query.addEventListener("change", () => known.clear());
  }

  get dark() {
    return this.query.matches;
  }

  /** Map of a slice quantity, 256 RGBA colours. */
  map(signed) {
    return (this.dark ? DARK : this.light)[signed ? "signed" : "magnitude"];
  }

  /** Colour of a grain as [r, g, b] from 0 to 1; later cycles of the palette are lighter. */
  grain(index) {
    const hex = this.grains[index % this.grains.length];
    const cycle = Math.floor(index / this.grains.length) % 3;
    return [1, 3, 5].map((i) => {
      const value = parseInt(hex.slice(i, i + 2), 16) / 255;
      return value + 0.25 * cycle * (1 - value);
    });
  }

  /** Colour of the path and the curves of a grain: lighter on a dark page. */
  line(index) {
    return this.grain(index).map((v) => (this.dark ? v + 0.22 * (1 - v) : v));
  }

  css(index) {
    return `rgb(${this.line(index).map((v) => Math.round(255 * v)).join(" ")})`;
  }
}

/** Colour of a position from 0 to 1 on a map, as [r, g, b] from 0 to 1. */
export function onMap(bytes, s) {
  const i = 4 * Math.round(255 * Math.min(1, Math.max(0, s)));
  return [bytes[i] / 255, bytes[i + 1] / 255, bytes[i + 2] / 255];
}

const known = new Map();

/** Value of a CSS variable of the page; remembered until the theme changes. */
export function theme(name) {
  if (!known.has(name)) {
    known.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  }
  return known.get(name);
}
