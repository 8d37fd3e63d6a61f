import type { Strip } from "../ui/plot.ts";
import type { Slot } from "./slot.ts";

/** Events per second of a recording's camera. */
export function rateStrip(slot: Slot, suffix: string): Strip[] {
  const { rate, info } = slot;
  if (!rate || !info || rate.on.length === 0) return [];
  const highest = Math.max(...rate.on, ...rate.off);
  const [scale, unit] = highest >= 1e6 ? [1e6, "Mev/s"] : highest >= 1e3 ? [1e3, "kev/s"] : [1, "ev/s"];
  const t = rate.on.map((_, i) => (rate.edges[i]! + rate.edges[i + 1]!) / 2 - info.start);
  const scaled = (values: number[], sign: 1 | -1) => values.map((value) => (sign * value) / scale);
  // ON upwards and OFF downwards, on the same scale.
  const curves = [
    { colour: "on", t, values: scaled(rate.on, 1), filled: true },
    { colour: "off", t, values: scaled(rate.off, -1), filled: true },
  ];
  return [{ label: `Rate${suffix} ±`, unit, low: -highest / scale, high: highest / scale, curves }];
}

/** Measurements of a recording's IMU. */
export function imuStrips(slot: Slot): Strip[] {
  const { imu, info } = slot;
  if (!imu || !info || imu.t.length === 0) return [];
  const t = imu.t.map((time) => time - info.start);
  const axes = (values: [number, number, number][]) =>
    (["x", "y", "z"] as const).map((axis, i) => ({ colour: axis, t, values: values.map((value) => value[i]!) }));
  return [
    { label: "Gyro xyz", unit: "rad/s", curves: axes(imu.angular_velocity) },
    { label: "Accel xyz", unit: "m/s²", curves: axes(imu.linear_acceleration) },
  ];
}
