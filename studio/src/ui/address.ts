/** The state in the page's address, which a reload restores. */
export interface Address {
  place: string;
  scenario?: string;
  run?: string;
  recordings: string[];
}

export function readAddress(hash: string): Address {
  const [place = "", query = ""] = hash.replace(/^#\/?/, "").split("?");
  const parts = new URLSearchParams(query);
  const [scenario, run] = [parts.get("scenario"), parts.get("run")];
  return { place, ...(scenario ? { scenario } : {}), ...(run ? { run } : {}), recordings: parts.getAll("recording") };
}

export function writeAddress(address: Address): string {
  const parts = new URLSearchParams();
  if (address.scenario) parts.set("scenario", address.scenario);
  if (address.run) parts.set("run", address.run);
  for (const path of address.recordings) parts.append("recording", path);
  const query = parts.toString();
  return `#/${address.place}${query ? `?${query}` : ""}`;
}
