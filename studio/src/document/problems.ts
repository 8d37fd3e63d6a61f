import type { Problem } from "../api/types.ts";
import { ask } from "../ui/dialog.ts";
import { h } from "../ui/dom.ts";

/** A list of problems with links to their options. */
export function problemEntries(problems: Problem[], go: (where: string) => void): HTMLElement[] {
  return problems.map(({ where, what }) =>
    h(
      "li",
      {},
      h(
        "button",
        { type: "button", class: "plain", on: { click: () => go(where) } },
        where ? h("code", { text: where }) : null,
        h("span", { class: "problem", text: what }),
      ),
    ),
  );
}

/** Reports that problems prevented an action; returns the option that the user wants to see, or null. */
export async function refuseFor(title: string, why: string, problems: Problem[]): Promise<string | null> {
  let chosen: string | null = null;
  const list = h("ul", { class: "problems" });
  list.append(
    ...problemEntries(problems, (where) => {
      chosen = where;
      list.closest("dialog")?.close();
    }),
  );
  const answer = await ask<string>(
    title,
    [h("p", { text: why }), list],
    [
      { label: "Close", value: null as never },
      { label: "Go to the option", value: problems[0]!.where, kind: "primary" },
    ],
  );
  return chosen ?? answer;
}
