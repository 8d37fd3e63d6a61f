import { Signal } from "../ui/signal.ts";

/** An error answer of the server; `where` is the option that it concerns. */
export class ApiError extends Error {
  constructor(
    message: string,
    readonly status: number,
    readonly where: string | undefined,
    /** The complete answer; a conflict contains the file's current text. */
    readonly body: Record<string, unknown>,
  ) {
    super(message);
  }
}

/** The server did not answer at all. */
export class ServerGone extends Error {
  constructor() {
    super("The server does not answer. The page keeps trying, and your changes stay here.");
  }
}

export type Connection = "there" | "gone" | "denied";
export const connection = new Signal<Connection>("there");

const retry_ms = 1000;
let retrying = false;

/** Asks for the session until the server answers again. */
async function waitForServer(): Promise<void> {
  if (retrying) return;
  retrying = true;
  while (connection.value === "gone") {
    await new Promise((resolve) => setTimeout(resolve, retry_ms));
    try {
      const answer = await fetch("/api/session");
      connection.set(answer.status === 401 ? "denied" : "there");
    } catch {
      // still gone
    }
  }
  retrying = false;
}

/** Reports that the server is gone, for requests that other files send. */
export function serverIsGone(): void {
  if (connection.value !== "gone") connection.set("gone");
  void waitForServer();
}

async function failure(answer: Response): Promise<ApiError> {
  let body: Record<string, unknown> = {};
  try {
    body = (await answer.json()) as Record<string, unknown>;
  } catch {
    // not JSON: use the status
  }
  const text =
    typeof body["error"] === "string" ? body["error"] : `the server answered ${answer.status} ${answer.statusText}`;
  return new ApiError(text, answer.status, typeof body["where"] === "string" ? body["where"] : undefined, body);
}

async function request(path: string, init: RequestInit): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(path, init);
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    serverIsGone();
    throw new ServerGone();
  }
  if (answer.status === 401) connection.set("denied");
  else if (connection.value !== "there") connection.set("there");
  if (!answer.ok) throw await failure(answer);
  return answer;
}

const kept_ms = 10_000;
/** Answers that were requested in advance, by their question. */
const answers = new Map<string, Promise<unknown>>();
let isAhead = false;

/** Sends a request in advance that another part of the page will soon make. */
export function askAhead<T>(question: () => Promise<T>): Promise<T> {
  isAhead = true;
  try {
    return question();
  } finally {
    isAhead = false;
  }
}

function answerTo<T>(key: string, ask: () => Promise<T>): Promise<T> {
  const known = answers.get(key) as Promise<T> | undefined;
  answers.delete(key);
  if (known) return known;
  const answer = ask();
  if (!isAhead) return answer;
  answers.set(key, answer);
  answer.catch(() => answers.delete(key));
  setTimeout(() => answers.delete(key), kept_ms);
  return answer;
}

export type Query = Record<string, string | number | boolean | undefined>;

/** A path with its query. */
export function url(path: string, query: Query = {}): string {
  const parts = new URLSearchParams();
  for (const [name, value] of Object.entries(query)) if (value !== undefined) parts.set(name, String(value));
  const text = parts.toString();
  return text ? `${path}?${text}` : path;
}

export function getJson<T>(path: string, query?: Query, signal?: AbortSignal): Promise<T> {
  const address = url(path, query);
  return answerTo(address, async () => (await (await request(address, { signal: signal ?? null })).json()) as T);
}

export function sendJson<T>(
  method: "POST" | "PUT" | "DELETE",
  path: string,
  body: unknown,
  signal?: AbortSignal,
): Promise<T> {
  const content = JSON.stringify(body);
  const headers = { "Content-Type": "application/json" };
  return answerTo(`${method} ${path} ${content}`, async () => {
    const text = await (await request(path, { method, headers, body: content, signal: signal ?? null })).text();
    return (text ? JSON.parse(text) : {}) as T;
  });
}

export async function getBytes(path: string, query: Query, signal?: AbortSignal): Promise<ArrayBuffer> {
  return (await request(url(path, query), { signal: signal ?? null })).arrayBuffer();
}

/** An image, its time (X-Time-Ns) and its number of events (X-Events), if the server gives them. */
export interface Picture {
  picture: ImageBitmap;
  time_ns: number | null;
  events: number | null;
}

export async function getPicture(path: string, query: Query, signal?: AbortSignal): Promise<Picture> {
  return asPicture(await request(url(path, query), { signal: signal ?? null }));
}

export async function postForPicture(path: string, body: unknown, signal?: AbortSignal): Promise<ImageBitmap> {
  const answer = await request(path, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(body),
    signal: signal ?? null,
  });
  return (await asPicture(answer)).picture;
}

async function asPicture(answer: Response): Promise<Picture> {
  const number = (name: string) => (answer.headers.has(name) ? Number(answer.headers.get(name)) : null);
  return {
    picture: await createImageBitmap(await answer.blob()),
    time_ns: number("X-Time-Ns"),
    events: number("X-Events"),
  };
}
