/** Numbers and times as text for users, with units and limited width. */

const grouping = "\u202f"; // narrow space between groups of three digits

/** At most `digits` significant digits, without trailing zeros: 0.25, 1200, 3.1e-7. */
export function shortNumber(value: number, digits = 4): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "–" : value > 0 ? "∞" : "-∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e9)
    return value
      .toExponential(digits - 1)
      .replace(/\.?0+e/, "e")
      .replace("e+", "e");
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return String(Number(value.toFixed(Math.min(decimals, 12))));
}

/** A whole number in groups of three digits. */
export function count(value: number): string {
  return Math.round(value)
    .toString()
    .replace(/\B(?=(\d{3})+(?!\d))/g, grouping);
}

/** 1234567 as 1.23 M. */
export function magnitude(value: number): string {
  for (const [size, name] of [
    [1e9, "G"],
    [1e6, "M"],
    [1e3, "k"],
  ] as const) {
    if (Math.abs(value) >= size) return `${shortNumber(value / size, 3)}${grouping}${name}`;
  }
  return `${shortNumber(value, 3)}${grouping}`.trimEnd();
}

/** Seconds with a fixed number of decimals, in groups of three: 1.234 567 s. */
export function seconds(time_ns: number, decimals = 3): string {
  const text = (time_ns / 1e9).toFixed(decimals);
  const [whole, fraction] = text.split(".");
  if (!fraction) return `${whole}${grouping}s`;
  return `${whole}.${fraction.match(/.{1,3}/g)!.join(grouping)}${grouping}s`;
}

/** A duration in a suitable unit: 250 µs, 33.3 ms, 5 s, 2 min 5 s. */
export function duration(span_ns: number): string {
  const size = Math.abs(span_ns);
  if (size < 1e3) return `${shortNumber(span_ns, 3)}${grouping}ns`;
  if (size < 1e6) return `${shortNumber(span_ns / 1e3, 3)}${grouping}µs`;
  if (size < 1e9) return `${shortNumber(span_ns / 1e6, 3)}${grouping}ms`;
  if (size < 60e9) return `${shortNumber(span_ns / 1e9, 3)}${grouping}s`;
  const all = Math.round(span_ns / 1e9);
  const [minutes, rest] = [Math.floor(all / 60), all % 60];
  if (minutes < 60) return `${minutes}${grouping}min ${rest}${grouping}s`;
  return `${Math.floor(minutes / 60)}${grouping}h ${minutes % 60}${grouping}min`;
}

/** Parses typed seconds: "1.5", "1.5 s", "1500 ms", "2:05", "250us"; NaN for anything else. */
export function parseSeconds(text: string): number {
  const trimmed = text.trim().replace(",", ".");
  const clock = /^(\d+):([0-5]?\d(?:\.\d*)?)$/.exec(trimmed);
  if (clock) return Number(clock[1]) * 60 + Number(clock[2]);
  const match = /^(-?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*(s|ms|us|µs|ns|min)?$/i.exec(trimmed);
  if (!match) return NaN;
  const scale = { s: 1, ms: 1e-3, us: 1e-6, µs: 1e-6, ns: 1e-9, min: 60 }[match[2]?.toLowerCase() ?? "s"];
  return Number(match[1]) * (scale ?? NaN);
}

export function bytes(size: number): string {
  if (size < 1000) return `${size}${grouping}B`;
  if (size < 1e6) return `${shortNumber(size / 1e3, 3)}${grouping}kB`;
  if (size < 1e9) return `${shortNumber(size / 1e6, 3)}${grouping}MB`;
  return `${shortNumber(size / 1e9, 3)}${grouping}GB`;
}

/** About `wanted` ticks with a round step in a range; includes the ends if they are ticks. */
export function ticks(low: number, high: number, wanted: number): number[] {
  if (!(high > low)) return [low];
  const rough = (high - low) / Math.max(1, wanted);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((candidate) => candidate >= rough)!;
  const first = Math.ceil(low / step - 1e-9);
  const result: number[] = [];
  for (let i = first; i * step <= high + step * 1e-9; ++i) result.push(Number((i * step).toPrecision(12)));
  return result;
}
