export interface DiffRow<T = string> {
  mine: T | null;
  theirs: T | null;
  same: boolean;
}

/** The table of a longest common subsequence has at most as many cells: lists that differ more are replaced. */
const max_cells = 2 ** 22;

/** Two texts line by line, equal lines side by side; null for missing counterparts. */
export function diffLines(mine: string, theirs: string): DiffRow[] {
  return diff(mine.split("\n"), theirs.split("\n"), (line) => line);
}

/** Two lists, items with equal keys side by side (longest common subsequence); null for missing counterparts. */
export function diff<T>(mine: T[], theirs: T[], keyOf: (item: T) => string): DiffRow<T>[] {
  const [a, b] = [mine.map(keyOf), theirs.map(keyOf)];
  const shorter = Math.min(a.length, b.length);
  let [head, tail] = [0, 0];
  while (head < shorter && a[head] === b[head]) ++head;
  while (tail < shorter - head && a.at(-1 - tail) === b.at(-1 - tail)) ++tail;
  const [a_end, b_end] = [a.length - tail, b.length - tail];
  const width = b_end - head + 1;
  const cells = (a_end - head + 1) * width;
  const common = new Uint32Array(cells <= max_cells ? cells : 0);
  const commonOf = (i: number, j: number) => common[(i - head) * width + j - head] ?? 0;
  for (let i = a_end - 1; i >= head && cells <= max_cells; --i) {
    for (let j = b_end - 1; j >= head; --j) {
      common[(i - head) * width + j - head] =
        a[i] === b[j] ? commonOf(i + 1, j + 1) + 1 : Math.max(commonOf(i + 1, j), commonOf(i, j + 1));
    }
  }
  const rows: DiffRow<T>[] = [];
  const pairUntil = (end: number) => {
    while (i < end) rows.push({ mine: mine[i++]!, theirs: theirs[j++]!, same: true });
  };
  let [i, j] = [0, 0];
  pairUntil(head);
  while (i < a_end || j < b_end) {
    if (i < a_end && j < b_end && a[i] === b[j]) {
      pairUntil(i + 1);
    } else if (j === b_end || (i < a_end && commonOf(i + 1, j) >= commonOf(i, j + 1))) {
      rows.push({ mine: mine[i++]!, theirs: null, same: false });
    } else {
      rows.push({ mine: null, theirs: theirs[j++]!, same: false });
    }
  }
  pairUntil(a.length);
  return rows;
}
