import "./ui/styles/base.css";
import "./ui/styles/layout.css";
import "./ui/styles/design.css";
import "./ui/styles/configure.css";
import "./ui/styles/look.css";
import { connection } from "./api/http.ts";
import * as server from "./api/server.ts";
import { h } from "./ui/dom.ts";
import { Shell } from "./shell.ts";

/** Waits for the server, so that a page that is loaded while it starts finds its way. */
async function begin(): Promise<void> {
  const app = document.getElementById("app")!;
  try {
    const session = await server.session();
    await new Shell(app, session).begin();
  } catch (error) {
    const text =
      connection.value === "denied"
        ? "This page needs the address that esim studio printed when it was started: open that one."
        : error instanceof Error
          ? error.message
          : String(error);
    app.replaceChildren(h("p", { class: "stage-note problem", attrs: { role: "alert" }, text }));
    if (connection.value === "gone") connection.listen((state) => state === "there" && location.reload());
  }
}

void begin();
