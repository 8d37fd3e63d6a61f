import "./ui/styles/base.css";
import "./ui/styles/layout.css";
import "./ui/styles/design.css";
import "./ui/styles/configure.css";
import "./ui/styles/look.css";
import "./ui/styles/narrow.css";
import { askAhead, connection } from "./api/http.ts";
import * as server from "./api/server.ts";
import type { Session } from "./api/types.ts";
import { readAddress } from "./ui/address.ts";
import { h } from "./ui/dom.ts";
import { Shell } from "./shell.ts";

/** Lets the server read the scene while the page is being built. */
async function askForScene({ opened }: Session): Promise<void> {
  const { place, scenario } = readAddress(location.hash);
  const path = scenario ?? (opened.kind === "scenario" ? opened.path : null);
  if (!path || !["", "design"].includes(place)) return;
  const { yaml } = await askAhead(() => server.openScenario(path));
  const source = { yaml, dir: path.split("/").slice(0, -1).join("/") };
  askAhead(() => server.scene(source)).catch(() => undefined);
  askAhead(() => server.trajectory(source)).catch(() => undefined);
}

/** Waits for the server, so that a page that is loaded while the server starts works. */
async function begin(): Promise<void> {
  const app = document.getElementById("app")!;
  try {
    const session = await server.session();
    await askForScene(session).catch(() => undefined); // the design place reports errors
    await new Shell(app, session).begin();
  } catch (error) {
    const text =
      connection.value === "denied"
        ? "Open the address that esim studio printed when it started; it contains the token that this page needs."
        : error instanceof Error
          ? error.message
          : String(error);
    app.replaceChildren(h("p", { class: "stage-note problem", attrs: { role: "alert" }, text }));
    if (connection.value === "gone") connection.listen((state) => state === "there" && location.reload());
  }
}

void begin();
