/** A round width of cells, 1, 2 or 5 times a power of ten, of which 16 to 40 go into `size` [m]. */
export function cellWidth(size_m: number): number {
  if (!(size_m > 0) || !Number.isFinite(size_m)) return 1;
  const widest = size_m / 16;
  const power = 10 ** Math.floor(Math.log10(widest) + 1e-9);
  const step = [5, 2, 1].find((factor) => factor * power <= widest * (1 + 1e-9)) ?? 1;
  return Number((step * power).toPrecision(3));
}

/**
 * The opacity of a waypoint's frustum, 0 to 1: 1 for the selected one; for others it decreases with the distance
 * relative to the frustum's length.
 */
export function frustumOpacity(selected: boolean, distance: number, depth: number): number {
  if (selected) return 1;
  const [near, far] = [4 * depth, 30 * depth];
  const share = Math.min(1, Math.max(0, (distance - near) / (far - near)));
  return 0.6 * (1 - share) + 0.1 * share;
}
