import { ApiError, connection, serverIsGone } from "../api/http.ts";
import * as server from "../api/server.ts";
import type { RunState } from "../api/types.ts";
import { type Answer, ask, askText } from "../ui/dialog.ts";
import { button, h } from "../ui/dom.ts";
import { count, duration, magnitude, seconds } from "../ui/format.ts";
import type { Place } from "../ui/place.ts";
import { complain, say } from "../ui/status.ts";

const ended = (state: string) => state === "done" || state === "failed" || state === "cancelled";
const stateNames = {
  waiting: "waiting for the previous run",
  running: "running",
  done: "done",
  failed: "failed",
  cancelled: "cancelled",
};

/** The interface of the run place to the page. */
export interface RunContext {
  /** Saves the scenario; returns its path, or null if it was not saved. */
  saved: () => Promise<string | null>;
  look: (path: string) => void;
  /** Shows an option in the form. */
  reveal: (where: string) => void;
  isOpen: (scenario: string) => boolean;
}

/** The server's runs: their progress and their cameras' views. */
export class RunPlace implements Place {
  readonly element: HTMLElement;
  /** Called when the watched run changes, to update the page's address. */
  watched: (id: string | null) => void = () => undefined;
  private list = h("div", { class: "run-list scroll", attrs: { role: "list", "aria-label": "Runs" } });
  private picture = h("canvas", {
    class: "run-picture",
    width: 1,
    height: 1,
    attrs: { role: "img", "aria-label": "Events so far, over the image" },
  } as object);
  private bar = h("progress", { attrs: { max: 1, value: 0, "aria-label": "Progress of the run" } });
  private title = h("h1", { text: "No run yet" });
  private figures = h("dl", { class: "figures" });
  private error = h("p", { class: "problem", attrs: { role: "alert" } });
  private refusal: ApiError | null = null;
  /** The option that made a run fail. */
  private wrong = "";
  private toOption = button("", () => this.context.reveal(this.wrong), { class: "small" });
  private cancel = button("Cancel the run", () => void this.cancelRun(), { class: "danger" });
  private lookButton: HTMLButtonElement;
  private runs: RunState[] = [];
  private current: RunState | null = null;
  private stream: EventSource | null = null;
  private pictureBusy = false;
  private pictureWanted = -1;
  private pictureShown = -1;

  constructor(private context: RunContext) {
    this.lookButton = button(
      "Look at the recording",
      () => this.current && context.look(this.current.recording ?? this.current.out),
      { class: "primary" },
    );
    this.element = h(
      "main",
      { class: "place run", attrs: { "aria-label": "Run" } },
      h(
        "section",
        { class: "run-view" },
        h("header", { class: "run-head" }, this.title, this.error, this.toOption),
        h("div", { class: "run-picture-frame" }, this.picture),
        h(
          "footer",
          { class: "run-foot" },
          this.bar,
          this.figures,
          h("div", { class: "row" }, this.cancel, this.lookButton),
        ),
      ),
      h(
        "aside",
        { class: "panel", attrs: { "aria-label": "Runs" } },
        h("section", { class: "runs-section" }, h("header", {}, h("h2", { text: "Runs of this server" })), this.list),
      ),
    );
    connection.listen((state) => state === "there" && this.watch(this.current?.id ?? null));
    this.showCurrent();
  }

  show(visible: boolean): void {
    this.element.hidden = !visible;
    if (visible) void this.refresh();
  }

  /** Saves and starts a run; asks if a recording already exists. */
  async start(): Promise<void> {
    const path = await this.context.saved();
    if (!path) return;
    await this.launch(path, undefined, false);
  }

  private async launch(path: string, out: string | undefined, overwrite: boolean): Promise<void> {
    this.refusal = null;
    try {
      const { id } = await server.startRun(path, out, overwrite);
      await this.refresh();
      this.watch(id);
    } catch (error) {
      if (error instanceof ApiError && error.status === 409) return this.askWhere(path, out, error);
      complain(error);
      this.refusal = error instanceof ApiError ? error : null;
      this.showCurrent();
    }
  }

  /** The folder has a recording, which can be replaced, or a run is writing to it. */
  private async askWhere(path: string, out: string | undefined, { message, body }: ApiError): Promise<void> {
    const running = body["running"] === true;
    const replace: Answer<"over" | "other">[] = running ? [] : [{ label: "Replace it", value: "over", kind: "danger" }];
    const answer = await ask<"over" | "other">(
      running ? "A run is writing there" : "The recording already exists",
      [h("p", { text: message })],
      [
        { label: "Cancel", value: null as never },
        ...replace,
        { label: "Another folder…", value: "other", kind: "primary" },
      ],
    );
    if (answer === "over") return this.launch(path, out, true);
    if (answer !== "other") return;
    const proposal = `${out ?? path.replace(/([^/]*)\.ya?ml$/, "out/$1")}-2`;
    const other = await askText(
      "Where should the recording be saved?",
      "A folder below the server's roots",
      proposal,
      "Run",
    );
    if (other) return this.launch(path, other, false);
  }

  /** Why the last run could not start or failed, with a link to the option if any. */
  private showError(run: RunState | null): void {
    const { refusal } = this;
    this.error.textContent = this.error.title = refusal?.message ?? run?.error ?? "";
    const where = refusal ? refusal.where : run && this.context.isOpen(run.scenario) ? run.where : undefined;
    this.wrong = where ?? "";
    this.toOption.hidden = !where;
    this.toOption.textContent = `Go to ${where}`;
  }

  /** Reconnects to a run, also after a reload of the page. */
  async rejoin(id: string): Promise<void> {
    await this.refresh();
    if (this.runs.some((run) => run.id === id)) this.watch(id);
  }

  private async refresh(): Promise<void> {
    try {
      this.runs = await server.runs();
    } catch (error) {
      return complain(error);
    }
    const live = this.runs.find((run) => run.state === "running") ?? this.runs.at(-1);
    if (!this.current && live) this.watch(live.id);
    this.showList();
  }

  private watch(id: string | null): void {
    this.stream?.close();
    this.stream = null;
    const run = this.runs.find((one) => one.id === id);
    if (!id || !run) return;
    if (this.current?.id !== id) {
      this.pictureShown = this.pictureWanted = -1;
      this.picture.width = this.picture.height = 1; // clears the image of another run
    }
    this.current = run;
    this.watched(id);
    const stream = new EventSource(`/api/runs/${id}/stream`);
    this.stream = stream;
    const on = (name: string, act: (data: Partial<RunState> & { n?: number }) => void) =>
      stream.addEventListener(name, (event) => act(JSON.parse((event as MessageEvent<string>).data || "{}") as never));
    on("progress", (data) => this.advance({ state: "running", ...data }));
    on("picture", ({ n }) => n !== undefined && void this.showPicture(id, n));
    on("done", (data) => this.finish({ state: "done", ...data }));
    on("failed", (data) => this.finish({ state: "failed", ...data }));
    on("cancelled", (data) => this.finish({ state: "cancelled", ...data }));
    stream.onerror = () => {
      if (stream.readyState !== EventSource.CLOSED && !ended(this.current?.state ?? "")) serverIsGone();
    };
    this.showCurrent();
    this.showList();
  }

  private advance(change: Partial<RunState>): void {
    if (!this.current) return;
    Object.assign(this.current, change);
    this.showCurrent();
    this.showList();
  }

  private finish(change: Partial<RunState>): void {
    this.stream?.close();
    this.stream = null;
    this.advance({ left_s: 0, ...change });
    const run = this.current;
    if (run?.state === "done") say(`Done: ${run.recording ?? run.out}`);
    if (run?.state === "cancelled")
      say(
        run.recording
          ? `Cancelled; the simulated part is kept: ${run.recording}`
          : "Cancelled before anything was recorded",
      );
  }

  private async showPicture(id: string, n: number): Promise<void> {
    this.pictureWanted = Math.max(this.pictureWanted, n);
    if (this.pictureBusy) return;
    this.pictureBusy = true;
    try {
      while (this.current?.id === id && this.pictureShown < this.pictureWanted) {
        const wanted = this.pictureWanted;
        const { picture } = await server.runPicture(id, wanted);
        this.pictureShown = wanted;
        if (this.current?.id !== id) break;
        this.picture.width = picture.width;
        this.picture.height = picture.height;
        this.picture.getContext("2d")!.drawImage(picture, 0, 0);
        picture.close();
      }
    } catch {
      // wait for the next image
    }
    this.pictureBusy = false;
  }

  private async cancelRun(): Promise<void> {
    const run = this.current;
    if (!run) return;
    try {
      await server.cancelRun(run.id);
      if (!ended(run.state)) say("Cancelling the run; the simulated part is kept");
    } catch (error) {
      complain(error);
    }
  }

  private showCurrent(): void {
    const run = this.current;
    this.title.textContent = run ? run.scenario : "No run yet";
    this.showError(run);
    this.cancel.disabled = !run || ended(run.state);
    this.lookButton.disabled = !run || !(run.state === "done" || (run.state === "cancelled" && run.recording));
    const share = shareOf(run);
    this.bar.value = share;
    const simulated = run?.t !== undefined && run.start !== undefined ? run.t - run.start : null;
    const span = run?.end !== undefined && run.start !== undefined ? run.end - run.start : null;
    const figures: [string, string][] = [
      ["State", run ? (run.state === "running" && run.loading ? "reading the scene" : stateNames[run.state]) : "–"],
      ["Simulated", simulated !== null && span !== null ? `${seconds(simulated)} of ${seconds(span)}` : "–"],
      ["Events", run?.events !== undefined ? count(run.events) : "–"],
      ["Samples", run?.samples !== undefined ? count(run.samples) : "–"],
      ["Elapsed", run?.elapsed_s !== undefined ? duration(run.elapsed_s * 1e9) : "–"],
      [
        "Left",
        run && !ended(run.state) && run.left_s != null
          ? `about ${duration(Math.max(1, Math.round(run.left_s)) * 1e9)}`
          : "–",
      ],
    ];
    this.figures.replaceChildren(
      ...figures.map(([name, value]) => h("div", {}, h("dt", { text: name }), h("dd", { text: value }))),
    );
  }

  private showList(): void {
    if (this.runs.length === 0)
      return this.list.replaceChildren(
        h("p", { class: "quiet", text: "None yet. Runs continue when the page is closed, and appear here again." }),
      );
    this.list.replaceChildren(
      ...[...this.runs].reverse().map((run) => {
        const state = run.state === "running" ? `${Math.round(100 * shareOf(run))} %` : run.state;
        return h(
          "div",
          { attrs: { role: "listitem" } },
          h(
            "button",
            {
              type: "button",
              class: "plain run-entry",
              attrs: { "aria-current": String(run.id === this.current?.id) },
              on: {
                click: () => {
                  this.refusal = null;
                  this.watch(run.id);
                },
                dblclick: () => run.state === "done" && this.context.look(run.recording ?? run.out),
              },
            },
            h("span", { class: "grow", text: run.out || run.scenario }),
            h("span", { class: `badge${run.state === "failed" ? " bad" : ""}`, text: state }),
            run.events !== undefined ? h("span", { class: "quiet", text: magnitude(run.events) }) : null,
          ),
        );
      }),
    );
  }
}

function shareOf(run: RunState | null): number {
  if (!run) return 0;
  if (run.state === "done") return 1;
  if (run.t === undefined || run.start === undefined || run.end === undefined || run.end <= run.start) return 0;
  return Math.min(1, Math.max(0, (run.t - run.start) / (run.end - run.start)));
}
